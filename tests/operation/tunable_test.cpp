// Settings that act during a teleoperation: each key copies its own value and no other.
#include "operation/tunable.h"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>
#include <string>

namespace operation::tunable_test {

constexpr std::size_t kValues = 7;

/// What a key can change, as the cycle receives it.
std::array<double, kValues> tuning_of(const Config& config) {
  const control::TeleopTuning tuning = control::Teleoperation::tuning_of(config.teleoperation);
  return {tuning.stiff.translation_N_per_m,
          tuning.stiff.rotation_Nm_per_rad,
          tuning.force_scale,
          tuning.force_feedback ? 1.0 : 0.0,
          tuning.contact_share,
          tuning.motion_scale,
          tuning.rate_speed_m_per_s};
}

/// Differs from the default in each of them.
Config another() {
  Config config;
  config.teleoperation.stiff.translation_N_per_m += 1;
  config.teleoperation.stiff.rotation_Nm_per_rad += 1;
  config.teleoperation.feedback.force_scale += 0.1;
  config.teleoperation.force_feedback = !config.teleoperation.force_feedback;
  config.teleoperation.feedback.contact_share += 0.1;
  config.teleoperation.mapping.motion_scale += 0.1;
  config.teleoperation.mapping.rate_speed_m_per_s += 0.1;
  return config;
}

TEST(Tunable, EachKeyCopiesItsValueAndNoOther) {
  const std::array<double, kValues> before = tuning_of({});
  const std::array<double, kValues> wanted = tuning_of(another());
  std::array<int, kValues> copied{};
  for (const std::string_view key : tunable_keys()) {
    Config config;
    copy_tunable(key, another(), config);
    const std::array<double, kValues> after = tuning_of(config);
    int changed = 0;
    for (std::size_t i = 0; i < kValues; ++i) {
      if (after[i] == before[i]) continue;
      EXPECT_EQ(after[i], wanted[i]) << key;
      ++copied[i];
      ++changed;
    }
    EXPECT_EQ(changed, 1) << key;
  }
  for (std::size_t i = 0; i < kValues; ++i) EXPECT_EQ(copied[i], 1) << "value " << i;
}

TEST(Tunable, AnotherKeyCopiesNothing) {
  Config config;
  copy_tunable("limits.force_N", another(), config);
  EXPECT_EQ(tuning_of(config), tuning_of({}));
}

TEST(Tunable, WhatContradictsTheRunIsRefusedByItsName) {
  const auto refusal = [](const Config& config) {
    try {
      require_consistent(config);
      return std::string();
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refusal({}), "");
  Config soft;
  soft.teleoperation.stiff.translation_N_per_m = soft.teleoperation.soft.translation_N_per_m - 1;
  EXPECT_NE(refusal(soft).find("stiff_N_per_m"), std::string::npos) << refusal(soft);
  Config limp;
  limp.teleoperation.stiff.rotation_Nm_per_rad = limp.teleoperation.soft.rotation_Nm_per_rad - 0.1;
  EXPECT_NE(refusal(limp).find("stiff_Nm_per_rad"), std::string::npos) << refusal(limp);
  Config late;
  late.teleoperation.feedback.contact_share = 0.5;
  EXPECT_EQ(refusal(late), "");
  late.teleoperation.tank.active = false;
  EXPECT_NE(refusal(late).find("passivity"), std::string::npos) << refusal(late);
}

}  // namespace operation::tunable_test
