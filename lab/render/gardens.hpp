#pragma once

#include "building_site.hpp"
#include "random.hpp"

namespace sdvo::render {

/// What stands before the houses: hedges, fences and walls. `side` of the way: 1 right, −1 left.
void addGardens(BuildingSite& site, double side, Random random);

}  // namespace sdvo::render
