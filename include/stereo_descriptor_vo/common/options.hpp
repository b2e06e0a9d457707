#pragma once

#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "stereo_descriptor_vo/common/named_enum.hpp"

namespace sdvo {

/// Closed interval of admissible values.
struct Range {
  double min;
  double max;
};

/// An enum by reference, read and written as its position among the option's choices.
struct ChoiceReference {
  void* value;
  int (*get)(const void* value);
  void (*set)(void* value, int choice);
};

/// One option of a component, by reference: what a parameter server, a command line or a manual needs to know of it.
struct Option {
  std::string name;  ///< path such as "detector/max_features"
  std::variant<bool*, int*, double*, std::string*, ChoiceReference> value;
  Range range{0.0, 0.0};             ///< numbers only
  std::vector<std::string> choices;  ///< names of an enum's values
  std::string unit;                  ///< "px", "s", … or empty for a pure number
  std::string meaning;

  /// The present value as text, the same for equal values on every platform.
  std::string text() const;
  /// Parses and assigns; throws std::invalid_argument that names the option when the text is no such value.
  void set(const std::string& text);
  /// Throws std::invalid_argument that names the option, its value and its range. Text and enums have no range.
  void check() const;
  /// Whether its value is given as text: a free one, or the name of an enum's value.
  bool isText() const {
    return std::holds_alternative<std::string*>(value) || std::holds_alternative<ChoiceReference>(value);
  }
  /// Moves a number to the nearest end of its range; true when that changed it. Other types are left alone.
  bool clamp();
};

/// Collects the options of a struct and of the structs it is composed of. Every options struct has a member
/// `void describe(OptionList&)` that adds its fields in order; defaults stay in the struct itself. It may have a member
/// `void check() const` that throws std::invalid_argument if its fields contradict each other.
class OptionList {
 public:
  /// A number: an int or a double.
  template <class Number>
  void add(const std::string& name, Number& value, Range range, const std::string& unit, const std::string& meaning) {
    options_.push_back({prefix_ + name, &value, range, {}, unit, meaning});
  }
  /// The value is a bool, a text, or an enum whose choices have names (named_enum.hpp).
  template <class Value>
  void add(const std::string& name, Value& value, const std::string& meaning) {
    if constexpr (std::is_enum_v<Value>) {
      const ChoiceReference reference{
          &value, [](const void* v) { return static_cast<int>(*static_cast<const Value*>(v)); },
          [](void* v, int choice) { *static_cast<Value*>(v) = static_cast<Value>(choice); }};
      options_.push_back({prefix_ + name, reference, {}, namesOf(value), "", meaning});
    } else {
      static_assert(std::is_same_v<Value, bool> || std::is_same_v<Value, std::string>, "a number has a range");
      options_.push_back({prefix_ + name, &value, {}, {}, "", meaning});
    }
  }

  /// A component's fields under its name.
  template <class Options>
  void group(const std::string& name, Options& options) {
    const std::string outer = std::exchange(prefix_, prefix_ + name + "/");
    collect(options);
    prefix_ = outer;
  }

  /// A component's fields, without a group's name before theirs.
  template <class Options>
  void collect(Options& options) {
    options.describe(*this);
    if constexpr (HasCheck<Options>::value) checks_.push_back({prefix_, [&options] { options.check(); }});
  }

  const std::vector<Option>& options() const { return options_; }

  /// Throws std::invalid_argument at the first field outside its range and at the first component whose fields
  /// contradict each other. The message has the path of either.
  void check() const;

 private:
  template <class Options, class = void>
  struct HasCheck : std::false_type {};
  template <class Options>
  struct HasCheck<Options, std::void_t<decltype(std::declval<const Options&>().check())>> : std::true_type {};

  struct ComponentCheck {
    std::string prefix;
    std::function<void()> check;
  };

  std::string prefix_;
  std::vector<Option> options_;
  std::vector<ComponentCheck> checks_;
};

/// The fields of `options`, which must outlive the result.
template <class Options>
std::vector<Option> listOptions(Options& options) {
  OptionList list;
  list.collect(options);
  return list.options();
}

/// The whole set: throws std::invalid_argument as OptionList::check() does; returns the options for use in
/// initialisers.
template <class Options>
Options checked(Options options) {
  OptionList list;
  list.collect(options);
  list.check();
  return options;
}

/// Sets the option whose path equals `name` or ends with "/" + name; throws std::invalid_argument when there is none.
void setOption(std::vector<Option>& options, const std::string& name, const std::string& text);

/// FNV-1a hash (16 hex digits) over all "name=value" lines. Equal options have equal hashes; different ones have
/// different hashes but for a chance of 2^-64.
std::string hashOptions(const std::vector<Option>& options);

}  // namespace sdvo
