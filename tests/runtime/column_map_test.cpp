// Tables of other programs: a column map says what is what, and a mistake in either is named with its remedy.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "runtime/recording/column_map.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/temporary_directory.h"

namespace column_map_test {

using runtime::ColumnMap;
using runtime::ConfigError;
using runtime::parse_recording;
using runtime::RecordingError;

const std::string kFormat = "format = \"youbot-column-map/1\"\n";
const std::string kTime = "[time_s]\ncolumn = \"t\"\nunit = \"s\"\n";
const std::string kPosition = "[position_rad]\ncolumn = \"q\"\nunit = \"rad\"\n";

class ColumnMaps : public testing::Test {
 protected:
  ColumnMap map(const std::string& text) {
    return runtime::read_column_map(directory_.write("map.toml", kFormat + text));
  }
  /// All problems of the map.
  std::string map_problems(const std::string& text) {
    try {
      map(text);
      return "";
    } catch (const ConfigError& error) {
      return error.what();
    }
  }
  static std::string problems(const std::string& table, const ColumnMap& columns) {
    try {
      parse_recording(table, "f.csv", columns);
      return "";
    } catch (const RecordingError& error) {
      return error.what();
    }
  }
  void expect_map_problem(const std::string& text, const std::string& part) {
    EXPECT_NE(map_problems(text).find(part), std::string::npos) << part << " in: " << map_problems(text);
  }
  void expect_problem(const std::string& table, const std::string& text, const std::string& part) {
    const std::string all = problems(table, map(text));
    EXPECT_NE(all.find(part), std::string::npos) << part << " in: " << all;
  }
  /// The second value of one column with this table.
  double second(const std::string& quantity, const std::string& rows) {
    const auto read =
        parse_recording("t;x\n0;0\n1;1\n", "f.csv",
                        map("gear_ratio = 4\n" + kTime + "[" + quantity + "]\ncolumn = \"x\"\n" + rows +
                            (quantity.find("torque") == 0 || quantity == "current_A"
                                 ? "[position_rad]\ncolumn = \"t\"\nunit = \"rad\"\n"
                                 : "")));
    return read.recording.column(quantity)[1];
  }

  support::TemporaryDirectory directory_;
};

TEST_F(ColumnMaps, UnitsBecomeSi) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(second("position_rad", "unit = \"deg\"\n"), kPi / 180);
  EXPECT_DOUBLE_EQ(second("position_rad", "unit = \"turns\"\n"), 2 * kPi);
  EXPECT_DOUBLE_EQ(second("position_rad", "unit = \"counts\"\ncounts_per_rev = 8192\n"), 2 * kPi / 8192);
  EXPECT_DOUBLE_EQ(second("velocity_rad_per_s", "unit = \"rpm\"\n"), 2 * kPi / 60);
  EXPECT_DOUBLE_EQ(second("velocity_rad_per_s", "unit = \"deg/s\"\n"), kPi / 180);
  EXPECT_DOUBLE_EQ(second("torque_measured_Nm", "unit = \"mNm\"\n"), 1e-3);
  for (const std::string unit : {"mN·m", "mN⋅m", "mN*m", "mN.m"})
    EXPECT_DOUBLE_EQ(second("torque_measured_Nm", "unit = \"" + unit + "\"\n"), 1e-3) << unit;
  EXPECT_DOUBLE_EQ(second("torque_command_Nm", "unit = \"Ncm\"\n"), 1e-2);
  EXPECT_DOUBLE_EQ(second("torque_measured_Nm", "unit = \"mA\"\ntorque_constant_Nm_per_A = 0.05\n"), 5e-5);
  EXPECT_DOUBLE_EQ(second("current_A", "unit = \"mA\"\n"), 1e-3);
}

TEST_F(ColumnMaps, TheMotorsSideTurnsFasterAndWithLessTorque) {
  EXPECT_DOUBLE_EQ(second("position_rad", "unit = \"rad\"\nside = \"motor\"\n"), 0.25);
  EXPECT_DOUBLE_EQ(second("velocity_rad_per_s", "unit = \"rad/s\"\nside = \"motor\"\n"), 0.25);
  EXPECT_DOUBLE_EQ(second("torque_measured_Nm", "unit = \"Nm\"\nside = \"motor\"\n"), 4);
  EXPECT_DOUBLE_EQ(second("torque_measured_Nm", "unit = \"Nm\"\nside = \"joint\"\nsign = -1\nfactor = 0.5\n"),
                   -0.5);
}

TEST_F(ColumnMaps, TimesCountFromTheFirstRow) {
  // Nanoseconds since 1970 exceed the digits of a double in seconds.
  const auto read = parse_recording("t,q\n1700000000000000000,1\n1700000000001000000,2\n", "f.csv",
                                    map("[time_s]\ncolumn = \"t\"\nunit = \"ns\"\n" + kPosition));
  EXPECT_EQ(read.recording.column("time_s")[0], 0);
  EXPECT_NEAR(read.recording.column("time_s")[1], 1e-3, 1e-6);
  EXPECT_EQ(read.first_row_line, 2U);
}

TEST_F(ColumnMaps, SeparatorsQuotationMarksByteOrderMarkAndLineEndsOfOtherPrograms) {
  for (const std::string table :
       {"t,q\n0,1\n0.5,2\n", "t;q\n0;1\n0.5;2\n", "t\tq\n0\t1\n0.5\t2\n",
        "\xEF\xBB\xBFt;q\r\n0;1\r\n0.5;2\r\n\r\n", "# exported\n\"q\",\"t\"\n\"1\",\"0\"\n2,+0.5\n"}) {
    const auto read = parse_recording(table, "f.csv", map(kTime + kPosition));
    ASSERT_EQ(read.recording.rows(), 2U) << table;
    EXPECT_EQ(read.recording.column("time_s")[1], 0.5) << table;
    EXPECT_EQ(read.recording.column("position_rad")[1], 2) << table;
  }
}

TEST_F(ColumnMaps, AnotherSeparatorThanTheMapsIsNamed) {
  expect_problem("t;q\n0;1\n", "separator = \",\"\n" + kTime + kPosition,
                 "f.csv:1: columns are separated by ';', not by ','; correct or delete separator in ");
  expect_problem("t,q\n0,1\n", "separator = \"tab\"\n" + kTime + kPosition,
                 "columns are separated by ',', not by tabs; correct or delete separator in ");
  expect_problem("t|q\n0|1\n", kTime + kPosition,
                 "columns are separated by '|', not by ','; export with ',', ';' or tabs between");
}

TEST_F(ColumnMaps, DecimalCommasAreReadIfTheMapSaysSoAndNamedOtherwise) {
  const std::string table = "t;q\n0,0;1,5\n0,5;-2,25\n";
  const auto read = parse_recording(table, "f.csv", map("decimal = \",\"\n" + kTime + kPosition));
  EXPECT_EQ(read.recording.column("time_s")[1], 0.5);
  EXPECT_EQ(read.recording.column("position_rad")[1], -2.25);
  expect_problem(
      table, kTime + kPosition,
      "f.csv:2: column 't' '0,0' is not a number; if ',' is its decimal point, set decimal = \",\" in");
  expect_problem("t;q\n0;1.5\n", "decimal = \",\"\n" + kTime + kPosition, "set decimal = \".\" in");
  expect_map_problem("decimal = \",\"\nseparator = \",\"\n" + kTime + kPosition, "is the separator, too");
}

TEST_F(ColumnMaps, ColumnsThatItDoesNotNameAreLeftOutAndReported) {
  const auto read = parse_recording("t,mood,q,mood\n0,x,1,y\n1,,2,\n", "f.csv",
                                    map("rig = \"axis\"\n" + kTime + kPosition));
  EXPECT_EQ(read.recording.columns.size(), 2U);
  EXPECT_EQ(read.recording.rig, "axis");
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_NE(read.warnings[0].find("f.csv:1: columns that "), std::string::npos);
  EXPECT_NE(read.warnings[0].find("were left out: 'mood', 'mood'"), std::string::npos) << read.warnings[0];
}

TEST_F(ColumnMaps, WithinQuotationMarksASeparatorIsText) {
  const auto read = parse_recording(
      "\"t\",\"q\",\"Pos, deg\"\n\"0,0\",\"1,5\",\"2,5\"\n\"0,5\",\"-2,25\",\"3\"\n", "f.csv",
      map("decimal = \",\"\n" + kTime + "[position_rad]\ncolumn = \"Pos, deg\"\nunit = \"rad\"\n"));
  ASSERT_EQ(read.recording.rows(), 2U);
  EXPECT_EQ(read.recording.column("time_s")[1], 0.5);
  EXPECT_EQ(read.recording.column("position_rad")[0], 2.5);
}

TEST_F(ColumnMaps, AnEncoderThatStartsAgainEachTurnIsCountedOn) {
  const auto read = parse_recording(
      "t,q\n0,3000\n1,3900\n2,800\n3,1700\n4,700\n5,3800\n", "f.csv",
      map("gear_ratio = 10\n" + kTime +
          "[position_rad]\ncolumn = \"q\"\nunit = \"counts\"\ncounts_per_rev = 4000\nwraps_at = 4000\n"
          "side = \"motor\"\n"));
  const std::vector<double> counts{3000, 3900, 4800, 5700, 4700, 3800};
  ASSERT_EQ(read.recording.rows(), counts.size());
  for (std::size_t i = 0; i < counts.size(); ++i)
    EXPECT_NEAR(read.recording.column("position_rad")[i], counts[i] / 4000 * 2 * std::numbers::pi / 10,
                1e-12);
}

TEST_F(ColumnMaps, ASetPointThatWrapsStaysBesideThePosition) {
  const std::string angle = "unit = \"deg\"\nwraps_at = 360\n";
  const auto read = parse_recording("t,q,goal\n0,359.8,0.2\n1,0.1,0.4\n2,359.9,359.7\n", "f.csv",
                                    map(kTime + "[position_rad]\ncolumn = \"q\"\n" + angle +
                                        "[position_command_rad]\ncolumn = \"goal\"\n" + angle));
  const std::vector<double> error_deg{0.4, 0.3, -0.2};
  ASSERT_EQ(read.recording.rows(), error_deg.size());
  for (std::size_t i = 0; i < error_deg.size(); ++i)
    EXPECT_NEAR(read.recording.column("position_command_rad")[i] - read.recording.column("position_rad")[i],
                error_deg[i] * std::numbers::pi / 180, 1e-12);
}

TEST_F(ColumnMaps, AQuotationMarkWithinANameIsText) {
  const auto read =
      parse_recording("t,load 5\",load 7\",q\n0,1,2,3\n1,1,2,4\n", "f.csv", map(kTime + kPosition));
  ASSERT_EQ(read.recording.rows(), 2U);
  EXPECT_EQ(read.recording.column("position_rad")[1], 4);
}

TEST_F(ColumnMaps, AFactorOfKelvinDoesNotScaleTheZero) {
  const auto read = parse_recording(
      "t,q,T\n0,1,2981\n1,2,3000\n", "f.csv",
      map(kTime + kPosition + "[temperature_C]\ncolumn = \"T\"\nunit = \"K\"\nfactor = 0.1\n"));
  EXPECT_NEAR(read.recording.column("temperature_C")[0], 24.95, 1e-9);
}

TEST_F(ColumnMaps, TheValueOfOneRunHasTheTablesDecimalPoint) {
  const auto read =
      parse_recording("run;t;q\n3,0;0;1\n3;1;2\n4;2;3\n", "f.csv",
                      map("decimal = \",\"\n[only]\ncolumn = \"run\"\nvalue = \"3\"\n" + kTime + kPosition));
  EXPECT_EQ(read.recording.rows(), 2U);
}

TEST_F(ColumnMaps, OnlyTheRowsOfOneRunAreTaken) {
  const std::string only = "[only]\ncolumn = \"run\"\nvalue = \"3\"\n";
  const std::string table = "run,t,q\n2,0,1\n3.0,0,5\n3,1,6\n4,0,7\n";
  const auto read = parse_recording(table, "f.csv", map(only + kTime + kPosition));
  ASSERT_EQ(read.recording.rows(), 2U);
  EXPECT_EQ(read.recording.column("position_rad")[0], 5);
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_EQ(read.warnings[0],
            "f.csv: 2 rows were left out by the value of another column ([only], or a log's torque_enable)");
  expect_problem("run,t,q\n2,0,1\n", only + kTime + kPosition, "leaves out all rows ([only]");
}

TEST_F(ColumnMaps, AServosTorqueFollowsItsPositionErrorUpToItsSupply) {
  // Duty = 0.5 · 2 · error, within ±0.5; 3 N·m at full duty: 0.3 / 1 · 10.
  const ColumnMap columns =
      map(kTime + kPosition +
          "[position_command_rad]\ncolumn = \"goal\"\nunit = \"rad\"\n"
          "[torque_command_Nm.servo]\nerror_gain_per_rad = 0.5\nkp = 2\nmax_duty = 0.5\n"
          "torque_constant_Nm_per_A = 0.3\nresistance_ohm = 1\nsupply_V = 10\n");
  const auto read = parse_recording("t,q,goal\n0,1,1.2\n1,1,0.9\n2,0,9\n3,0,-9\n", "f.csv", columns);
  const auto torque = read.recording.column("torque_command_Nm");
  EXPECT_NEAR(torque[0], 0.6, 1e-12);
  EXPECT_NEAR(torque[1], -0.3, 1e-12);
  EXPECT_NEAR(torque[2], 1.5, 1e-12);
  EXPECT_NEAR(torque[3], -1.5, 1e-12);
}

TEST_F(ColumnMaps, BadTablesAreNamedWithLineColumnAndRemedy) {
  const std::string both = kTime + kPosition;
  expect_problem("t,qq\n0,1\n", both, "f.csv:1: there is no column 'q', which [position_rad] of ");
  expect_problem("t,q_\n0,1\n", both, "the columns are 't', 'q_'");
  expect_problem("t,position\n0,1\n", kTime + "[position_rad]\ncolumn = \"positon\"\nunit = \"rad\"\n",
                 "did you mean 'position'?");
  expect_problem("0,1\n1,2\n", both, "this line has only numbers: put a row of names before it");
  expect_problem("+0.0,,1e-3\n1,2,3\n", both, "this line has only numbers");
  expect_problem("0,5;1,5\n1;2\n", "separator = \";\"\ndecimal = \",\"\n" + both,
                 "this line has only numbers");
  expect_problem("0,5;1,5\n1;2\n", "separator = \";\"\n" + both, "this line has only numbers");
  const std::string all = problems("0,1\n1,2\n", map(both));  // once, not for each column
  EXPECT_EQ(all.find("only numbers"), all.rfind("only numbers"));
  EXPECT_EQ(all.find("there is no column"), std::string::npos) << all;
  expect_problem("t,q,q\n0,1,2\n", both, "column 'q', which [position_rad] of ");
  expect_problem("t,q,q\n0,1,2\n", both, "is there twice; rename one");
  expect_problem("t,q\n0,nan\n", both, "f.csv:2: column 'q' 'nan' is not a finite number");
  expect_problem("t,q\n0,inf\n", both, "is not a finite number");
  expect_problem("t,q\n0,\n", both, "f.csv:2: column 'q' is empty");
  expect_problem("t,q\n0,x\n", both, "'x' is not a number");
  expect_problem("t,q\n0,1,2\n", both, "f.csv:2: 3 values for 2 columns");
  expect_problem("t,q\n0,1\n\n1,1\n", both, "f.csv:3: the line is empty");
  expect_problem("t,q\n0,1\n0,2\n", both, "f.csv:3: time_s repeats 0");
  expect_problem("t,q\n1,1\n0,2\n", both, "time_s runs backward");
  expect_problem("t,q\n", both, "no data rows");
  expect_problem("", both, "the file is empty");
  expect_problem("# only this\n", both, "no row of column names");
}

TEST_F(ColumnMaps, ATornLastLineIsLeftOutWithAWarning) {
  const auto read = parse_recording("t,q\n0,1\n1,2\n2,3", "f.csv", map(kTime + kPosition));
  EXPECT_EQ(read.recording.rows(), 2U);
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_NE(read.warnings[0].find("f.csv:4: the last line is torn"), std::string::npos);
}

TEST_F(ColumnMaps, BadMapsAreNamedWithLineKeyAndRemedy) {
  expect_map_problem(kTime, "'position_rad' and velocity_rad_per_s are missing");
  expect_map_problem(kPosition, "'time_s' is missing");
  expect_map_problem(kTime + "[position_rad]\ncolumn = \"q\"\nunit = \"degrees\"\n",
                     "map.toml:7: 'position_rad.unit' is 'degrees'; for position_rad there are rad, mrad, "
                     "deg, turns, counts");
  expect_map_problem(kTime + "[position_rad]\ncolumn = \"q\"\n", "position_rad.unit");
  expect_map_problem(kTime + "[position_rad]\ncolumn = \"q\"\nunit = \"counts\"\n", "counts_per_rev");
  expect_map_problem(kTime + kPosition + "[torque_measured_Nm]\ncolumn = \"i\"\nunit = \"A\"\n",
                     "torque_constant_Nm_per_A");
  expect_map_problem(kTime + kPosition + "side = \"motor\"\n", "there is no gear_ratio");
  expect_map_problem(kTime + kPosition + "sign = 0.5\n", "is 1 or -1");
  expect_map_problem(kTime + kPosition + "factor = 0\n", "every value would be the same");
  expect_map_problem(kTime + kPosition + "colum = \"q\"\n", "colum");
  expect_map_problem(kTime + kPosition + "[speed]\ncolumn = \"v\"\n", "speed");
  expect_map_problem(kTime + kPosition +
                         "[torque_command_Nm.servo]\nerror_gain_per_rad = 1\n"
                         "torque_constant_Nm_per_A = 1\nresistance_ohm = 1\n",
                     "needs [position_rad] and [position_command_rad]");
}

}  // namespace column_map_test
