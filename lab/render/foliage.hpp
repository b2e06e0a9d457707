#pragma once

#include <Eigen/Core>

#include "mesh.hpp"
#include "random.hpp"

namespace sdvo::render {

/// A single leaf around `at`, turned at random; `half` of its length in m.
void addLeaf(Mesh& mesh, Random& random, const Eigen::Vector3d& at, double half);

/// A rough ball of foliage.
void addTuft(Mesh& mesh, Random& random, const Eigen::Vector3d& centre, double radius);

}  // namespace sdvo::render
