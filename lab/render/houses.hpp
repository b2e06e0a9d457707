#pragma once

#include "building_site.hpp"
#include "random.hpp"

namespace sdvo::render {

/// The row of houses that faces the road. `side` of the way: 1 right, −1 left.
void addHouses(BuildingSite& site, double side, Random random);

/// Houses behind that row, seen through its gaps.
void addSecondRow(BuildingSite& site, double side, Random random);

}  // namespace sdvo::render
