#pragma once

#include "building_site.hpp"
#include "random.hpp"

namespace sdvo::render {

/// Trees along the road and, with fewer leaves, farther away. `side` of the way: 1 right, −1 left.
void addTrees(BuildingSite& site, double side, Random random);

/// A closed curtain of trees where the ground ends: the horizon of a street is never bare.
void addWood(BuildingSite& site, Random random);

}  // namespace sdvo::render
