/// @file
/// A recording as columns of numbers.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace support {

class Recording {
 public:
  /// Throws std::runtime_error if a row is not as wide as the header.
  explicit Recording(const std::filesystem::path& path) : path_(path) {
    std::ifstream file(path);
    std::vector<std::vector<double>*> columns;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("#")) continue;
      if (columns.empty()) {
        for (std::size_t from = 0; from <= line.size(); from = line.find(',', from) + 1) {
          columns.push_back(&columns_[line.substr(from, line.find(',', from) - from)]);
          if (line.find(',', from) == line.npos) break;
        }
        continue;
      }
      const char* at = line.c_str();
      for (std::vector<double>* column : columns) {
        char* end = nullptr;
        column->push_back(std::strtod(at, &end));
        if (end == at) throw std::runtime_error(path.string() + ": a torn row: " + line);
        at = *end == ',' ? end + 1 : end;
      }
      ++rows_;
    }
  }
  std::size_t rows() const { return rows_; }
  bool has(const std::string& column) const { return columns_.contains(column); }
  const std::vector<double>& operator[](const std::string& column) const {
    const auto found = columns_.find(column);
    if (found == columns_.end()) throw std::runtime_error(path_.string() + " has no column " + column);
    return found->second;
  }

 private:
  std::filesystem::path path_;
  std::map<std::string, std::vector<double>> columns_;
  std::size_t rows_ = 0;
};

}  // namespace support
