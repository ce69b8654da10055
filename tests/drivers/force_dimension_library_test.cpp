#include "drivers/haptic/force_dimension_library.h"

#include <gtest/gtest.h>
#include <sys/utsname.h>

#include <cstdlib>

#include "drivers/setup_error.h"
#include "tests/drivers/force_dimension_fakes.h"

namespace drivers::haptic {
namespace force_dimension_library_test {

using Paths = std::vector<std::string>;

std::string folder_name() {
  utsname system{};
  ::uname(&system);
  return "lib/release/lin-" + std::string(system.machine) + "-gcc/";
}

std::string refusal(const SdkSearch& search) {
  try {
    const ForceDimensionLibrary library(search);
    return "loaded " + library.path();
  } catch (const SetupError& error) {
    return error.what();
  }
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

struct ForceDimensionSdk : testing::Test {
  std::string in_sdk(const std::string& name) const { return (sdk / (folder_name() + name)).string(); }
  SdkSearch search() const { return {.file = {}, .sdk_folder = sdk.path().string()}; }
  support::TemporaryDirectory sdk;
};

TEST_F(ForceDimensionSdk, NamedFileIsTheOnlyCandidate) {
  sdk.write(folder_name() + "libdrd.so.3.17.5", "");
  EXPECT_EQ(sdk_candidates({.file = "/opt/libdrd.so", .sdk_folder = sdk.path().string()}),
            (Paths{"/opt/libdrd.so"}));
}

TEST_F(ForceDimensionSdk, VersionsAreSortedAsNumbersNewestFirst) {
  for (const char* version : {"3.9.1", "3.17.5", "3.17", "3.17.10", "3.2.0"})
    sdk.write(folder_name() + "libdrd.so." + version, "");
  EXPECT_EQ(sdk_candidates(search()),
            (Paths{in_sdk("libdrd.so.3.17.10"), in_sdk("libdrd.so.3.17.5"), in_sdk("libdrd.so.3.17"),
                   in_sdk("libdrd.so.3.9.1"), in_sdk("libdrd.so.3.2.0"), "libdrd.so.3", "libdrd.so"}));
}

TEST_F(ForceDimensionSdk, WhatOnlyLooksLikeALibraryIsLeftOut) {
  for (const char* name : {"libdrd.so.3.17.5~", "libdrd.so.", "libdrd.so.3.", "libdrd.so.x", "libdrd.so.3..1",
                           "libdhd.so.3.17.5", "libdrd_stand_in.so", "libdrd.so.99999999999", "libdrd.so.-3"})
    sdk.write(folder_name() + name, "");
  EXPECT_EQ(sdk_candidates(search()), (Paths{"libdrd.so.3", "libdrd.so"}));
}

TEST_F(ForceDimensionSdk, WithoutAFolderOnlyTheLoadersOwnNamesAreTried) {
  EXPECT_EQ(sdk_candidates({}), (Paths{"libdrd.so.3", "libdrd.so"}));
  EXPECT_EQ(sdk_candidates({.file = {}, .sdk_folder = "/no/such/folder"}),
            (Paths{"libdrd.so.3", "libdrd.so"}));
}

TEST_F(ForceDimensionSdk, FolderComesFromTheEnvironment) {
  ::setenv("FDSDK", "/opt/sdk-3.17.5", 1);
  EXPECT_EQ(sdk_search_from_environment("x").sdk_folder, "/opt/sdk-3.17.5");
  EXPECT_EQ(sdk_search_from_environment("x").file, "x");
  ::unsetenv("FDSDK");
  EXPECT_EQ(sdk_search_from_environment().sdk_folder, "");
}

TEST_F(ForceDimensionSdk, NewestOfTheFolderIsLoadedWithEverySymbol) {
  const StandIn older(sdk, folder_name() + "libdrd.so.3.9.0");
  const StandIn newer(sdk, folder_name() + "libdrd.so.3.17.5");
  newer.control().set_sdk_version(3, 17, 5, 1234);
  const ForceDimensionLibrary library(search());
  EXPECT_EQ(library.path(), newer.path());
  EXPECT_EQ(to_string(library.version()), "3.17.5.1234");
  EXPECT_TRUE(library.missing().empty()) << "the stand-in has all that the table lists";
  EXPECT_EQ(library.functions().get_device_count(), 1);
}

TEST_F(ForceDimensionSdk, NothingFoundSaysWhatWasTriedAndWhereToGetIt) {
  const std::string said = refusal(search());
  EXPECT_PRED2(says, said, "no libdrd.so.<version> in " + in_sdk("").substr(0, in_sdk("").size() - 1));
  EXPECT_PRED2(says, said, "libdrd.so.3 does not load");
  EXPECT_PRED2(says, said, "forcedimension.com");
  EXPECT_PRED2(says, said, "FDSDK");
  EXPECT_PRED2(says, said, "libusb-1.0");
}

TEST_F(ForceDimensionSdk, FileThatIsNoLibraryIsRefusedWithTheLoadersReason) {
  const std::string file = sdk.write("libdrd.so", "not a library").string();
  EXPECT_PRED2(says, refusal({.file = file, .sdk_folder = {}}), file + " does not load (");
}

TEST_F(ForceDimensionSdk, LibraryWithoutAVersionIsNotThisSdk) {
  const StandIn other(sdk, "other.so", {"dhdGetSDKVersion"});
  EXPECT_PRED2(says, refusal({.file = other.path(), .sdk_folder = {}}), "no dhdGetSDKVersion");
}

TEST_F(ForceDimensionSdk, OtherMajorVersionsAreRefusedSayingFoundAndNeeded) {
  const StandIn library(sdk, "any.so");
  for (const int major : {0, 2, 4}) {
    library.control().set_sdk_version(major, 1, 2, 3);
    const std::string said = refusal({.file = library.path(), .sdk_folder = {}});
    EXPECT_PRED2(says, said, "is version " + std::to_string(major) + ".1.2.3, needed is 3");
  }
}

TEST_F(ForceDimensionSdk, RefusedVersionLeavesTheNextOneItsTurn) {
  const StandIn next(sdk, folder_name() + "libdrd.so.4.0.0");
  const StandIn ours(sdk, folder_name() + "libdrd.so.3.16.1");
  next.control().set_sdk_version(4, 0, 0, 0);
  EXPECT_EQ(ForceDimensionLibrary(search()).path(), ours.path());
}

TEST_F(ForceDimensionSdk, MissingSymbolIsListedWithItsFeatureAndRequiredByName) {
  const StandIn old(sdk, "old.so", {"dhdSetWatchdog", "dhdErrorGetLast"});
  const ForceDimensionLibrary library({.file = old.path(), .sdk_folder = {}});
  ASSERT_EQ(library.missing().size(), 2U);
  EXPECT_FALSE(library.has("dhdSetWatchdog"));
  EXPECT_TRUE(library.has("dhdGetWatchdog"));
  EXPECT_EQ(library.functions().set_watchdog, nullptr);
  EXPECT_NO_THROW(library.require({"dhdGetWatchdog"}));
  try {
    library.require({"dhdSetForce", "dhdSetWatchdog"});
    FAIL();
  } catch (const SetupError& error) {
    EXPECT_PRED2(says, error.what(), "dhdSetWatchdog (setting the watchdog)");
    EXPECT_FALSE(says(error.what(), "dhdErrorGetLast"));
    EXPECT_PRED2(says, error.what(), "newer SDK");
  }
}

TEST(ForceDimensionWords, ErrorsAndCausesAreWordsForEveryNumber) {
  for (int code = 0; code <= 22; ++code) EXPECT_STRNE(describe_sdk_error(code), "unknown error") << code;
  for (const int code : {-1, 23, 1000}) EXPECT_STREQ(describe_sdk_error(code), "unknown error");
  EXPECT_STREQ(describe_sdk_error(2), "communication error");
  EXPECT_STREQ(describe_sdk_error(20), "the device is in use");
  for (int cause = 0; cause <= 6; ++cause)
    EXPECT_STRNE(describe_force_off(cause), "an unknown cause") << cause;
  EXPECT_STREQ(describe_force_off(7), "an unknown cause");
  EXPECT_PRED2(says, describe_force_off(kForceOffWatchdog), "watchdog");
  EXPECT_STREQ(describe_system_type(33), "omega.3");
  EXPECT_STREQ(describe_system_type(-7), "another device");
}

}  // namespace force_dimension_library_test
}  // namespace drivers::haptic
