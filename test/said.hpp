#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// What errors and reports say.
namespace sdvo {

inline bool contains(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

inline void expectWords(const std::string& text, const std::vector<std::string>& all) {
  for (const std::string& words : all) EXPECT_TRUE(contains(text, words)) << "without \"" << words << "\": " << text;
}

/// The message of the exception that `action` throws, or "no error".
inline std::string errorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "no error";
}

inline void expectError(const std::function<void()>& action, const std::vector<std::string>& all) {
  const std::string error = errorOf(action);
  EXPECT_NE(error, "no error");
  expectWords(error, all);
}

/// Damages to a T of which `check` refuses each one, in these words. Each begins with a sound T.
template <class T>
using Refusals = std::vector<std::pair<std::function<void(T&)>, std::string>>;

template <class T, class Check>
void expectRefusals(const T& sound, const Check& check, const Refusals<T>& refusals) {
  EXPECT_EQ(errorOf([&] { check(sound); }), "no error");
  for (const auto& [damage, words] : refusals) {
    T damaged = sound;
    damage(damaged);
    expectError([&] { check(damaged); }, {words});
  }
}

}  // namespace sdvo
