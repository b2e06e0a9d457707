#pragma once

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "../common/whole_file.hpp"
#include "file_kind.hpp"

namespace sdvo {

/// "file 'poses/06.txt', line 3": where an error in a text file is.
inline std::string placeInFile(const std::string& path, int line) {
  return "file '" + path + "', line " + std::to_string(line);
}

/// Throws std::runtime_error that names the file when it is missing, a directory or unreadable.
inline std::ifstream openTextFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw std::runtime_error("'" + path + "' is a directory, not a file");
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error("cannot read file '" + path +
                             (std::filesystem::exists(path) ? "': no permission?" : "': it does not exist"));
  }
  if (const std::string other = std::filesystem::is_regular_file(path) ? otherKindOf(path) : ""; !other.empty())
    throw std::runtime_error("file '" + path + "' is " + other);
  return file;
}

/// Words of a line separated by white space; a carriage return at its end counts as such.
inline std::vector<std::string> splitWords(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// Files of one kind have the same first line up to its first number. If a number comes first, they have the same count
/// of words in that line.
inline std::string kindOfText(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  const std::string kind = line.substr(0, line.find_first_of("+-.0123456789"));
  return kind.empty() ? std::to_string(splitWords(line).size()) : kind;
}

/// Writes a text file whole or not at all. It replaces only files of its kind. Devices are written directly. Throws
/// std::runtime_error that names the file.
inline void writeTextFile(const std::string& path, const std::string& text) {
  namespace fs = std::filesystem;
  if (fs::exists(path) && !fs::is_regular_file(path) && !fs::is_directory(path)) {
    std::ofstream device(path);
    device << text;
    device.close();
    if (!device) throw std::runtime_error("'" + path + "': cannot be written: is the device full?");
    return;
  }
  if (fs::is_regular_file(path) && !fs::is_empty(path)) {
    std::string before(std::min<std::uintmax_t>(fs::file_size(path), 65536), '\0');  // B; no first line is longer
    std::ifstream(path).read(before.data(), static_cast<std::streamsize>(before.size()));
    if (kindOfText(before) != kindOfText(text))
      throw std::runtime_error("file '" + path + "' is of another kind and stays: give another name, or remove it");
  }
  writeWhole(fs::absolute(path).string(), text);
}

/// Parses a finite number with a decimal point, in any locale. Throws std::invalid_argument that quotes the word if it
/// is none. Number is double or long double.
template <class Number = double>
Number parseNumber(const std::string& word) {
  std::istringstream stream(word);
  stream.imbue(std::locale::classic());
  Number value{};
  if (!(stream >> value) || !(stream >> std::ws).eof() || !std::isfinite(value)) {
    throw std::invalid_argument("'" + word + "' is not a finite number");
  }
  return value;
}

/// A stream of numbers with twelve decimals, which every locale reads as they were written.
inline std::ostringstream numberStream() {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::scientific << std::setprecision(12);
  return stream;
}

/// Calls `read(line)` for each line that is neither blank nor a comment (#). A std::invalid_argument of `read` becomes
/// a std::runtime_error that names file and line. If `lines_count`, line i belongs to frame i, and a blank line among
/// the others is such an error.
template <class Read>
void readLines(const std::string& path, bool lines_count, const Read& read) {
  std::ifstream file = openTextFile(path);
  int number = 0, blank = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (number == 1 && line.rfind("\xef\xbb\xbf", 0) == 0) line.erase(0, 3);  // of Windows' editors
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    if (line.empty()) blank = blank == 0 ? number : blank;
    const std::size_t first = line.find_first_not_of(" \t");
    if (first == std::string::npos || line[first] == '#') continue;
    if (lines_count && blank > 0)
      throw std::runtime_error(placeInFile(path, blank) + ": a blank line among the others");
    try {
      read(line);
    } catch (const std::invalid_argument& e) {
      throw std::runtime_error(placeInFile(path, number) + ": " + e.what());
    }
  }
  if (file.bad()) throw std::runtime_error("cannot read file '" + path + "' to its end");
}

/// Digits alone; throws std::invalid_argument.
inline std::int64_t parseNanoseconds(const std::string& word) {
  std::int64_t stamp = -1;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), stamp);
  if (error != std::errc() || end != word.data() + word.size() || stamp < 0)
    throw std::invalid_argument("'" + word + "' is not a stamp in nanoseconds");
  return stamp;
}

/// Seconds as a decimal number to nanoseconds. Goes through long double: a double near today's Unix time resolves 200
/// ns.
inline std::int64_t parseSeconds(const std::string& word) {
  const long double nanoseconds = parseNumber<long double>(word) * 1e9L;
  if (std::abs(nanoseconds) > 9e18L) throw std::invalid_argument("'" + word + "' s is out of range");
  return std::llround(nanoseconds);
}

/// Nanoseconds as seconds with nine decimals, which parseSeconds() reads back exactly.
inline std::string formatSeconds(std::int64_t nanoseconds) {
  const std::int64_t giga = 1000000000;
  const std::string fraction = std::to_string(std::abs(nanoseconds % giga));
  return (nanoseconds < 0 ? "-" : "") + std::to_string(std::abs(nanoseconds / giga)) + "." +
         std::string(9 - fraction.size(), '0') + fraction;
}

}  // namespace sdvo
