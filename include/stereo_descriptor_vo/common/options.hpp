#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace sdvo {

/// Closed interval of admissible values.
struct Range {
  double min;
  double max;
};

/// One option of a component, by reference: what a parameter server, a command line or a manual needs to know of it.
struct Option {
  std::string name;  ///< path such as "detector/max_features"
  std::variant<bool*, int*, double*, std::string*> value;
  Range range{0.0, 0.0};             ///< numbers only
  std::vector<std::string> choices;  ///< strings only
  std::string unit;                  ///< "px", "s", … or empty for a pure number
  std::string meaning;

  /// The present value as text, the same for equal values on every platform.
  std::string text() const;
  /// Parses and assigns; throws std::invalid_argument that names the option when the text is no such value.
  void set(const std::string& text);
  /// Throws std::invalid_argument that names the option, its value and its range.
  void check() const;
  /// Moves a number to the nearest end of its range; true when that changed it. Other types are left alone.
  bool clamp();
};

/// Collects the options of a struct and of the structs it is composed of. Every options struct has a member
/// `void describe(OptionList&)` that adds its fields in order; defaults stay in the struct itself.
class OptionList {
 public:
  void add(const std::string& name, bool& value, const std::string& meaning);
  void add(const std::string& name, int& value, Range range, const std::string& unit, const std::string& meaning);
  void add(const std::string& name, double& value, Range range, const std::string& unit, const std::string& meaning);
  void add(const std::string& name, std::string& value, std::vector<std::string> choices, const std::string& meaning);

  template <class Options>
  void group(const std::string& name, Options& options) {
    const std::string outer = std::exchange(prefix_, prefix_ + name + "/");
    options.describe(*this);
    prefix_ = outer;
  }

  const std::vector<Option>& options() const { return options_; }
  std::vector<Option>& options() { return options_; }

 private:
  std::string prefix_;
  std::vector<Option> options_;
};

/// The fields of `options`, which must outlive the result.
template <class Options>
std::vector<Option> listOptions(Options& options) {
  OptionList list;
  options.describe(list);
  return list.options();
}

/// Throws std::invalid_argument at the first field outside its range; returns the options for use in initialisers.
template <class Options>
Options checked(Options options) {
  for (const Option& option : listOptions(options)) option.check();
  return options;
}

/// Sets the option whose path equals `name` or ends with "/" + name; throws std::invalid_argument when there is none.
void setOption(std::vector<Option>& options, const std::string& name, const std::string& text);

/// FNV-1a hash (16 hex digits) over all "name=value" lines: equal if and only if the effective options are equal.
std::string hashOptions(const std::vector<Option>& options);

}  // namespace sdvo
