#include "world.hpp"

namespace sdvo::render {

World makeWorld(Scenery scenery, const DrivePath& path, std::uint64_t seed) {
  switch (scenery) {
    case Scenery::kRoom:
      return makeRoomWorld(path, seed);
    case Scenery::kCorridor:
      return makeCorridorWorld(path, seed);
    case Scenery::kDesk:
      return makeDeskWorld(path, seed);
    default:
      return makeStreetWorld(path, seed);
  }
}

}  // namespace sdvo::render
