#pragma once

#include "building_site.hpp"
#include "random.hpp"

namespace sdvo::render {

/// Lamps, traffic signs and billboards. `side` of the way: 1 right, −1 left.
void addStreetFurniture(BuildingSite& site, double side, Random random);

}  // namespace sdvo::render
