#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace sdvo {

/// A subcommand; returns the exit code.
using Learning = std::function<int()>;

/// Add their options to a subcommand.
Learning addSizeCurve(CLI::App& app);
Learning addFreakPairs(CLI::App& app);

}  // namespace sdvo
