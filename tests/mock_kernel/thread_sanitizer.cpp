// GLib's locks are not pthread's, and its code, like umockdev's, is not instrumented: what they do among
// themselves looks like races. What our own code does in umockdev's thread is still watched.
extern "C" const char* __tsan_default_suppressions();  // NOLINT: the sanitizer's name
extern "C" const char* __tsan_default_suppressions() {
  return "race:libumockdev.so\n"
         "race:libglib-2.0.so\n"
         "race:libgobject-2.0.so\n"
         "race:libgio-2.0.so\n"
         "race:libudev.so\n";  // its hash key, which libusb's thread and umockdev's both set
}
