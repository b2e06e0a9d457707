#include "stereo_descriptor_vo/common/options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <locale>
#include <sstream>
#include <stdexcept>

namespace sdvo {
namespace {

std::string toText(double value) {
  for (int digits = std::numeric_limits<double>::digits10;; ++digits) {
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(digits);
    stream << value;
    if (digits >= std::numeric_limits<double>::max_digits10) return stream.str();
    std::istringstream back(stream.str());
    back.imbue(std::locale::classic());
    double again = 0.0;
    if (back >> again && again == value) return stream.str();
  }
}

double parseNumber(const std::string& name, const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double number{};
  if (!(stream >> number) || !(stream >> std::ws).eof())
    throw std::invalid_argument(name + " = '" + text + "' is not a number");
  return number;
}

/// `1000.0` and `1e3` are whole numbers, too.
int parseInteger(const std::string& name, const std::string& text) {
  const double number = parseNumber(name, text);
  if (number != std::trunc(number) || std::abs(number) > std::numeric_limits<int>::max())
    throw std::invalid_argument(name + " = '" + text + "' is not a whole number");
  return static_cast<int>(number);
}

bool parseBool(const std::string& name, const std::string& text) {
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  throw std::invalid_argument(name + " = '" + text + "' is neither true nor false");
}

}  // namespace

std::string Option::text() const {
  if (const auto* b = std::get_if<bool*>(&value)) return **b ? "true" : "false";
  if (const auto* i = std::get_if<int*>(&value)) return std::to_string(**i);
  if (const auto* d = std::get_if<double*>(&value)) return toText(**d);
  if (const auto* s = std::get_if<std::string*>(&value)) return **s;
  const auto& choice = std::get<ChoiceReference>(value);
  return choices.at(static_cast<std::size_t>(choice.get(choice.value)));
}

void Option::set(const std::string& text) {
  if (auto* b = std::get_if<bool*>(&value))
    **b = parseBool(name, text);
  else if (auto* i = std::get_if<int*>(&value))
    **i = parseInteger(name, text);
  else if (auto* d = std::get_if<double*>(&value))
    **d = parseNumber(name, text);
  else if (auto* s = std::get_if<std::string*>(&value))
    **s = text;
  else {
    const auto& choice = std::get<ChoiceReference>(value);
    const std::optional<int> chosen = indexOf(choices, text);
    if (!chosen) throw std::invalid_argument(name + " = " + noneOf(choices, text));
    choice.set(choice.value, *chosen);
  }
}

void Option::check() const {
  if (isText() || std::holds_alternative<bool*>(value)) return;
  const auto* i = std::get_if<int*>(&value);
  const double number = i ? **i : *std::get<double*>(value);
  if (!(number >= range.min && number <= range.max))
    throw std::invalid_argument(name + " = " + text() + " is outside [" + toText(range.min) + ", " + toText(range.max) +
                                "]" + (unit.empty() ? "" : " " + unit));
}

bool Option::clamp() {
  if (auto* i = std::get_if<int*>(&value)) {
    const int clamped = static_cast<int>(std::clamp<double>(**i, range.min, range.max));
    return std::exchange(**i, clamped) != clamped;
  }
  if (auto* d = std::get_if<double*>(&value)) {
    const double clamped = std::isnan(**d) ? range.min : std::clamp(**d, range.min, range.max);
    return std::exchange(**d, clamped) != clamped;
  }
  return false;
}

void OptionList::check() const {
  for (const Option& option : options_) option.check();
  for (const ComponentCheck& component : checks_) try {
      component.check();
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument(component.prefix + e.what());
    }
}

void setOption(std::vector<Option>& options, const std::string& name, const std::string& text) {
  const std::string suffix = "/" + name;
  const auto matches = [&](const Option& option) {
    const std::string& path = option.name;
    return path == name ||
           (path.size() > suffix.size() && path.compare(path.size() - suffix.size(), suffix.size(), suffix) == 0);
  };
  const auto found = std::find_if(options.begin(), options.end(), matches);
  if (found == options.end())
    throw std::invalid_argument("there is no option '" + name + "': list_parameters prints all");
  if (std::find_if(found + 1, options.end(), matches) != options.end())
    throw std::invalid_argument("option '" + name + "' is ambiguous, give its full path such as " + found->name);
  const std::string before = found->text();
  try {
    found->set(text);
    found->check();
  } catch (const std::invalid_argument&) {
    found->set(before);
    throw;
  }
}

std::string hashOptions(const std::vector<Option>& options) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const Option& option : options) {
    for (const char c : option.name + "=" + option.text() + "\n") {
      hash ^= static_cast<unsigned char>(c);
      hash *= 1099511628211ull;
    }
  }
  char hex[17];
  std::snprintf(hex, sizeof hex, "%016llx", static_cast<unsigned long long>(hash));
  return hex;
}

}  // namespace sdvo
