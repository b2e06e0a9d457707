#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drive_path.hpp"
#include "world.hpp"

namespace sdvo::render {

/// The names makePresetPath() knows.
const std::vector<std::string>& presetNames();

/// Where a preset takes place; std::nullopt where that is the rig's choice, as of a name that is no preset.
std::optional<Scenery> presetScenery(const std::string& name);

/// A preset at `rate` Hz: straight (10 m/s), figure_eight (two circles of 28 m radius), city_loop (1.1 km with three
/// stops), back_and_forth (20 m, five times), hover (a drone in a room), hover_1m (the same, all of its way shrunk into
/// 1 m^3), still, or one of robot_motions.hpp: hand_held, turn_in_place, corridor, desk. `frames` = 0 asks for the
/// preset's natural length. Drives shake a little as cars do. Throws std::invalid_argument for another name.
DrivePath makePresetPath(const std::string& name, int frames, double rate, std::uint64_t seed);

}  // namespace sdvo::render
