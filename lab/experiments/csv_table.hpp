#pragma once

#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../../src/data/text_file.hpp"

namespace sdvo {

/// Rows of a CSV file, also shown as an aligned table.
class CsvTable {
 public:
  explicit CsvTable(std::vector<std::string> columns) { rows_.push_back(std::move(columns)); }

  /// Cells of one row, numbers with six significant digits; as many as there are columns.
  template <class... Cells>
  void add(const Cells&... cells) {
    std::vector<std::string> row{text(cells)...};
    if (row.size() != rows_.front().size()) throw std::logic_error("a row of a table has the wrong number of cells");
    rows_.push_back(std::move(row));
  }

  /// Throws std::runtime_error when the file cannot be written.
  void write(const std::string& path) const {
    std::ostringstream file;
    for (const auto& row : rows_)
      for (std::size_t c = 0; c < row.size(); ++c) file << row[c] << (c + 1 < row.size() ? "," : "\n");
    writeTextFile(path, file.str());
  }

  std::string aligned() const {
    std::vector<std::size_t> widths(rows_.front().size(), 0);
    for (const auto& row : rows_)
      for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
    std::ostringstream out;
    for (const auto& row : rows_) {
      for (std::size_t c = 0; c < row.size(); ++c)
        out << (c ? "  " : "") << std::setw(static_cast<int>(widths[c])) << row[c];
      out << "\n";
    }
    return out.str();
  }

 private:
  static std::string text(const std::string& cell) { return cell; }
  static std::string text(const char* cell) { return cell; }
  static std::string text(int cell) { return std::to_string(cell); }
  static std::string text(double cell) {
    if (!(cell == cell)) return "";  // not a number: an empty cell
    std::ostringstream out;
    out << cell;
    return out.str();
  }

  std::vector<std::vector<std::string>> rows_;
};

}  // namespace sdvo
