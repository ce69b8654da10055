// Parquet files, byte by byte: put together by hand from parquet.thrift, Encodings.md and the specification
// of Thrift's compact protocol. tests/lerobot reads such files with programs of others.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/compression.h"
#include "runtime/parquet/parquet_writer.h"
#include "runtime/parquet/thrift_struct.h"
#include "tests/support/hex.h"

namespace parquet_bytes_test {

using runtime::parquet::append_varint;
using runtime::parquet::ParquetWriter;
using runtime::parquet::ThriftStruct;
using runtime::parquet::Type;
using runtime::parquet::Values;
using support::hex;

/// Without the blanks, which are for people.
std::string packed(std::string_view digits) {
  std::string result;
  for (const char c : digits)
    if (c != ' ') result += c;
  return result;
}

TEST(ThriftStruct, NumbersHaveSevenBitsAByteWithTheSignLast) {
  std::string varint;
  append_varint(varint, 50399);
  EXPECT_EQ(hex(varint), "df8903") << "the example of the specification";
  EXPECT_EQ(hex(ThriftStruct().i32(1, 0).i32(2, -1).i32(3, 1).bytes()), packed("1500 1501 1502 00"));
  EXPECT_EQ(hex(ThriftStruct().i64(1, std::numeric_limits<std::int64_t>::min()).bytes()),
            packed("16 ffffffffffffffffff01 00"));
}

TEST(ThriftStruct, AFieldHasItsStepFromTheOneBefore) {
  EXPECT_EQ(hex(ThriftStruct().i32(2, 0).text(5, "ab").structure(15, ThriftStruct()).bytes()),
            packed("2500 3802 6162 ac00 00"));
  EXPECT_THROW(ThriftStruct().i32(3, 0).i32(3, 0), std::logic_error);
  EXPECT_THROW(ThriftStruct().i32(16, 0), std::logic_error);
}

TEST(ThriftStruct, AListOf15OrMoreHasItsSizeBehind) {
  EXPECT_EQ(hex(ThriftStruct().i32_list(2, std::vector<std::int32_t>(14)).bytes()),
            "29e5" + std::string(28, '0') + "00");
  EXPECT_EQ(hex(ThriftStruct().i32_list(2, std::vector<std::int32_t>(15)).bytes()),
            "29f50f" + std::string(30, '0') + "00");
  EXPECT_EQ(hex(ThriftStruct().text_list(1, std::vector<std::string>{"a", ""}).bytes()),
            packed("1928 0161 00 00"));
}

/// A number below 64, as Thrift has it.
std::string small(std::size_t number) { return hex(std::string(1, static_cast<char>(number << 1))); }

TEST(ParquetWriter, AFileWithOneColumnHasTheBytesOfTheSpecification) {
  std::string file;
  ParquetWriter writer([&file](std::string_view part) { file += part; }, "me", {{"a", Type::kInt64}},
                       {{"k", "v"}});
  writer.add_row_group(2, std::vector<Values>{std::vector<std::int64_t>{7, -1}});
  EXPECT_EQ(writer.bytes_written(), file.size());
  const std::size_t data_end = file.size();
  writer.finish();

  constexpr std::size_t kHeader = 17;
  const std::size_t compressed = data_end - 4 - kHeader;
  ASSERT_LT(compressed, 40U);
  EXPECT_EQ(hex(file.substr(0, 4 + kHeader)),
            packed("50415231"  // PAR1
                   "1500 152c 15") +
                small(compressed) +  // a data page, its sizes: 22 bytes before compression
                packed("2c 1504 1500 1506 1506 00 00"));  // two values, plain; levels as runs
  EXPECT_EQ(hex(runtime::mcap::decompress("zstd", file.substr(4 + kHeader, compressed), 22)),
            packed("02000000 04 01"  // two rows that have a value
                   "0700000000000000 ffffffffffffffff"));

  const std::string whole = small(kHeader + 22);
  const std::string stored = small(kHeader + compressed);
  const std::string footer = packed(
                                 "1504"                       // version 2
                                 "192c"                       // schema, two elements:
                                 "4806 736368656d61 1502 00"  // its root has one child,
                                 "1504 2502 1801 61 00"       // an optional INT64 named a
                                 "1604"                       // two rows
                                 "191c"                       // one row group
                                 "191c"                       // with one column
                                 "2600 1c"                    // whose metadata are:
                                 "1504 1925 0006 1918 0161"   // INT64, plain with runs, path a,
                                 "150c 1604") +               // zstd, two values,
                             "16" +
                             whole + "16" + stored +                                  // sizes with header
                             packed("2608 00 00") +                                   // page at byte 4
                             "16" + whole + "1604" + "2608" + "16" + stored + "00" +  // of the row group
                             packed(
                                 "191c 1801 6b 1801 76 00"  // k = v
                                 "1802 6d65 00");           // written by me
  EXPECT_EQ(hex(file.substr(data_end, file.size() - data_end - 8)), footer);
  EXPECT_EQ(hex(file.substr(file.size() - 8)),
            hex(std::string(1, static_cast<char>(footer.size() / 2))) + "00000050415231");
}

TEST(ParquetWriter, TheLevelsOfAListSayWhereARowBegins) {
  std::string file;
  ParquetWriter writer([&file](std::string_view part) { file += part; }, "me", {{"a", Type::kFloat, 3}});
  writer.add_row_group(3, std::vector<Values>{std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, -2}});
  constexpr std::size_t kHeader = 17;
  const std::string page = runtime::mcap::decompress("zstd", file.substr(4 + kHeader), 1000);
  EXPECT_EQ(hex(page.substr(0, 13)),
            packed("03000000 05 b6 01"  // nine bits in two bytes, lowest first: 011 011 011
                   "02000000 12 03")
                .substr(0, 26));
  EXPECT_EQ(page.size(), 13U + 9 * 4);
  EXPECT_EQ(hex(page.substr(13, 4)), "0000803f");
  EXPECT_EQ(hex(page.substr(45)), "000000c0");
}

TEST(ParquetWriter, OtherValuesThanTheColumnsHaveAreRefused) {
  ParquetWriter writer([](std::string_view) {}, "me", {{"a", Type::kDouble, 2}, {"b", Type::kText}});
  const Values two = std::vector<double>{1, 2};
  const Values text = std::vector<std::string>{"x"};
  EXPECT_NO_THROW(writer.add_row_group(1, std::vector{two, text}));
  EXPECT_THROW(writer.add_row_group(1, std::vector{two}), std::invalid_argument);
  EXPECT_THROW(writer.add_row_group(1, std::vector{text, two}), std::invalid_argument);
  EXPECT_THROW(writer.add_row_group(2, std::vector{two, text}), std::invalid_argument);
}

}  // namespace parquet_bytes_test
