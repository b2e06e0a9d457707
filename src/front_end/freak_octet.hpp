#pragma once

#include <array>
#include <cstdint>

#include "freak.hpp"

namespace sdvo {

/// FREAK of eight key points at once: what a register holds.
constexpr int kOctet = 8;

/// Mean intensities of each receptive field for each of the eight.
using OctetMeans = std::array<std::array<float, kOctet>, Freak::kFields>;

/// The same numbers as Freak::intensities for each of the key points, which must fit.
void measureOctet(const Freak& freak, const ViewKeypoint* keypoints, OctetMeans& means);

/// Writes the eight rows that these means give.
void compareOctet(const OctetMeans& means, std::uint8_t* const* rows);

}  // namespace sdvo
