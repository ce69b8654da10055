// GLib's locks are not pthread's, and its code, like umockdev's, is not instrumented: their synchronization
// looks like races. Our own code in umockdev's thread is still checked.
extern "C" const char* __tsan_default_suppressions();  // NOLINT: the sanitizer's name
extern "C" const char* __tsan_default_suppressions() {
  return "race:libumockdev.so\n"
         "race:libglib-2.0.so\n"
         "race:libgobject-2.0.so\n"
         "race:libgio-2.0.so\n"
         "race:libudev.so\n";  // its hash key, which libusb's thread and umockdev's both set
}
