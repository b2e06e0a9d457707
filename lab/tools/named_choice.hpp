#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/named_enum.hpp"

namespace sdvo {

/// Options of a command line that take the names of an enum's values: one, or several separated by commas. What `value`
/// and `values` hold is the default; both must outlive the parsing.
template <class Enum>
CLI::Option* addChoice(CLI::App& app, const std::string& flag, Enum& value, const std::string& meaning) {
  return app
      .add_option_function<std::string>(
          flag, [&value](const std::string& name) { value = valueOf<Enum>(name); }, meaning)
      ->default_str(nameOf(value))
      ->check(CLI::IsMember(namesOf(Enum{})));
}

template <class Enum>
CLI::Option* addChoices(CLI::App& app, const std::string& flag, std::vector<Enum>& values, const std::string& meaning) {
  std::string defaults;
  for (const Enum value : values) defaults += (defaults.empty() ? "" : ",") + nameOf(value);
  const auto assign = [&values](const std::vector<std::string>& names) {
    values.clear();
    for (const std::string& name : names) values.push_back(valueOf<Enum>(name));
  };
  return app.add_option_function<std::vector<std::string>>(flag, assign, meaning)
      ->default_str(defaults)
      ->delimiter(',')
      ->check(CLI::IsMember(namesOf(Enum{})));
}

}  // namespace sdvo
