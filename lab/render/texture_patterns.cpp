#include "texture_patterns.hpp"

#include <opencv2/imgproc.hpp>

#include "random.hpp"

namespace sdvo::render {

namespace {

/// Fills a rectangle that may leave the tile on any side.
void fillWrapped(cv::Mat1f& image, int x, int y, int width, int height, float value) {
  const int side = image.rows;
  for (int row = y; row < y + height; ++row)
    for (int col = x; col < x + width; ++col) image((row % side + side) % side, (col % side + side) % side) = value;
}

/// Ellipse that wraps around the borders of the tile.
void ellipseWrapped(cv::Mat1f& image, double x, double y, double a, double b, double angle, float value) {
  const int side = image.rows;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j) {
      const double cx = x + i * side, cy = y + j * side, reach = std::max(a, b);
      if (cx < -reach || cy < -reach || cx > side + reach || cy > side + reach) continue;
      cv::ellipse(image, cv::RotatedRect(cv::Point2f(cx, cy), cv::Size2f(2.0 * a, 2.0 * b), angle), value, cv::FILLED);
    }
}

void crackWrapped(cv::Mat1f& image, Random& random, int steps, float value) {
  double x = random.uniform(0, image.cols), y = random.uniform(0, image.rows), heading = random.uniform(0, 2 * M_PI);
  for (int step = 0; step < steps; ++step) {
    heading += 0.35 * random.normal();
    x += std::cos(heading);
    y += std::sin(heading);
    fillWrapped(image, static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)), 2, 2, value);
  }
}

cv::Mat1f clamped(const cv::Mat1f& image) {
  return cv::min(cv::max(image, 0.0), 1.0);
}

cv::Mat1f asphalt(std::uint64_t seed) {
  Random random(seed, 1);
  cv::Mat1f image = 0.5 + 0.03 * makeNoise(1024, 1.0, seed + 1) + 0.10 * makeNoise(1024, 0.1, seed + 2);
  for (int i = 0; i < 5000; ++i)
    ellipseWrapped(image, random.uniform(0, 1024), random.uniform(0, 1024), random.uniform(0.6, 1.6), 0.8,
                   random.uniform(0, 180), static_cast<float>(random.chance(0.4) ? 0.78 : 0.25));
  for (int i = 0; i < 3; ++i) crackWrapped(image, random, 500, 0.22f);
  for (int i = 0; i < 2; ++i)
    fillWrapped(image, random.index(1024), random.index(1024), 60 + random.index(160), 40 + random.index(90), 0.40f);
  return clamped(image + 0.05 * makeNoise(1024, 0.3, seed + 3));
}

cv::Mat1f grass(std::uint64_t seed) {
  Random random(seed, 2);
  cv::Mat1f image = 0.42 + 0.07 * makeNoise(1024, 1.0, seed + 1);
  for (int i = 0; i < 26000; ++i) {
    const float value = static_cast<float>(random.uniform(0.12, 0.75));
    ellipseWrapped(image, random.uniform(0, 1024), random.uniform(0, 1024), random.uniform(1.5, 5.0),
                   random.uniform(0.6, 1.4), random.uniform(0, 180), value);
  }
  return clamped(image + 0.09 * makeNoise(1024, 0.4, seed + 2));
}

/// Courses of stones with joints; every second course is shifted by half a stone.
cv::Mat1f masonry(std::uint64_t seed, int side, int stone_width, int stone_height, double joint, double variation) {
  Random random(seed, 3);
  cv::Mat1f image(side, side, static_cast<float>(joint));
  for (int row = 0; row < side / stone_height; ++row)
    for (int col = 0; col < side / stone_width; ++col)
      fillWrapped(image, col * stone_width + (row % 2) * stone_width / 2 + 1, row * stone_height + 1, stone_width - 2,
                  stone_height - 2, static_cast<float>(0.55 + variation * random.normal()));
  return clamped(image + 0.03 * makeNoise(side, 1.0, seed + 1) + 0.05 * makeNoise(side, 0.3, seed + 2));
}

cv::Mat1f bark(std::uint64_t seed) {
  cv::Mat1f streaks;
  cv::resize(makeNoise(512, 0.6, seed), streaks, cv::Size(), 1.0, 8.0, cv::INTER_LINEAR);
  return clamped(0.5 + 0.16 * streaks.rowRange(0, 512) + 0.08 * makeNoise(512, 0.5, seed + 1));
}

cv::Mat1f foliage(std::uint64_t seed) {
  Random random(seed, 4);
  cv::Mat1f image = 0.2 + 0.08 * makeNoise(1024, 1.0, seed);
  for (int i = 0; i < 14000; ++i) {
    // Later leaves lie on top and catch more light; few are bright.
    const double light = random.uniform() * random.uniform() * (0.3 + 0.7 * i / 14000.0);
    ellipseWrapped(image, random.uniform(0, 1024), random.uniform(0, 1024), random.uniform(3.0, 11.0),
                   random.uniform(2.0, 6.0), random.uniform(0, 180), static_cast<float>(0.08 + 0.9 * light));
  }
  return clamped(image + 0.03 * makeNoise(1024, 0.4, seed + 1));
}

cv::Mat1f poster(std::uint64_t seed) {
  Random random(seed, 5);
  cv::Mat1f image = 0.55 + 0.18 * makeNoise(512, 1.2, seed);
  for (int i = 0; i < 14; ++i)
    ellipseWrapped(image, random.uniform(0, 512), random.uniform(0, 512), random.uniform(10, 70), random.uniform(8, 50),
                   random.uniform(0, 180), static_cast<float>(random.uniform(0.05, 1.0)));
  for (int line = 0; line < 7; ++line) {
    std::string text;
    for (int i = 0; i < 14; ++i) text += static_cast<char>('A' + random.index(26));
    const float background = random.chance(0.5) ? 0.9f : 0.1f;
    const int y = 20 + line * 72;
    if (random.chance(0.6)) {
      fillWrapped(image, 20, y, 472, 46, background);
      cv::putText(image, text, cv::Point(28, y + 36), cv::FONT_HERSHEY_SIMPLEX, 1.25, 1.0f - background, 3);
    }
  }
  return clamped(image);
}

/// 4 x 4 windows of 3.2 m on plaster; styles differ in the size, the division and the shutters of the windows.
cv::Mat1f facade(int style, std::uint64_t seed) {
  Random random(seed, 6);
  constexpr int kSide = 1024, kCell = 256;  // 12.5 mm per texel
  const double wall = style % 3 == 0 ? 0.93 : random.uniform(0.55, 0.85);
  cv::Mat1f image = wall + 0.015 * makeNoise(kSide, 1.1, seed) + 0.012 * makeNoise(kSide, 0.3, seed + 1);
  if (style == 2 || style == 5) image = 0.35 * image + 0.62 * masonry(seed + 2, kSide, 32, 16, 0.75, 0.07);
  const int width = 90 + random.index(60), height = 100 + random.index(50);
  const bool shutters = style == 1 || style == 4;
  for (int floor = 0; floor < 4; ++floor) {
    if (style == 3 || style == 5) fillWrapped(image, 0, floor * kCell + 248, kSide, 6, 0.4f);
    for (int column = 0; column < 4; ++column) {
      const int x = column * kCell + (kCell - width) / 2, y = floor * kCell + 60;
      fillWrapped(image, x - 7, y - 7, width + 14, height + 14, static_cast<float>(random.uniform(0.7, 0.95)));
      const float glass = static_cast<float>(random.uniform(0.04, 0.16));
      fillWrapped(image, x, y, width, height, glass);
      if (random.chance(0.5)) {  // a curtain, or what the glass mirrors
        const int drop = random.index(height);
        fillWrapped(image, x, y, width, drop, static_cast<float>(random.uniform(0.1, 0.45)));
      }
      if (random.chance(0.25)) {  // a blind with slats
        for (int slat = 0; slat < height * 2 / 3; slat += 6) fillWrapped(image, x, y + slat, width, 3, 0.6f);
      }
      fillWrapped(image, x + width / 2 - 3, y, 6, height, 0.8f);
      if (style % 2 == 0) fillWrapped(image, x, y + height / 3, width, 5, 0.8f);
      fillWrapped(image, x - 10, y + height + 7, width + 20, 8, 0.35f);  // sill and its shadow
      if (shutters)
        for (int side : {x - 52, x + width + 10})
          for (int slat = 0; slat < height; slat += 8) fillWrapped(image, side, y + slat, 42, 5, 0.25f);
    }
  }
  return clamped(image);
}

cv::Mat1f carSide(std::uint64_t seed) {
  return clamped(0.55 + 0.05 * makeNoise(256, 1.5, seed));
}

}  // namespace

cv::Mat1f makeNoise(int side, double exponent, std::uint64_t seed) {
  Random random(seed, 7);
  // Uniform numbers will do: every sample of the result is a sum of all of them, hence normal.
  cv::Mat1f white(side, side);
  for (float& value : white) value = static_cast<float>(random.uniform(-1.0, 1.0));
  cv::Mat2f spectrum;
  cv::dft(white, spectrum, cv::DFT_COMPLEX_OUTPUT);
  const int half = side / 2;
  cv::Mat1f amplitude(half + 1, half + 1);
  for (int fy = 0; fy <= half; ++fy)
    for (int fx = 0; fx <= half; ++fx)
      amplitude(fy, fx) =
          fx + fy > 0 ? std::pow(static_cast<float>(fx * fx + fy * fy), static_cast<float>(-0.5 * exponent)) : 0.0f;
  for (int row = 0; row < side; ++row)
    for (int col = 0; col < side; ++col)
      spectrum(row, col) *= amplitude(std::min(row, side - row), std::min(col, side - col));
  cv::Mat1f noise;
  cv::dft(spectrum, noise, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  cv::Scalar mean, deviation;
  cv::meanStdDev(noise, mean, deviation);
  return (noise - mean[0]) / deviation[0];
}

TextureSet::TextureSet(std::uint64_t seed, double scale)
    : textures_(static_cast<std::size_t>(Material::kFacade) + kFacadeCount) {
  const auto set = [&](Material material, const cv::Mat1f& image, double size) {
    textures_[static_cast<std::size_t>(material)] = std::make_shared<Texture>(image, scale * size);
  };
  set(Material::kAsphalt, asphalt(seed + 10), 10.24);
  set(Material::kGrass, grass(seed + 20), 7.0);
  set(Material::kPaving, masonry(seed + 30, 1024, 32, 16, 0.3, 0.05), 6.4);
  set(Material::kBrick, masonry(seed + 40, 512, 32, 16, 0.8, 0.08), 4.0);
  set(Material::kBark, bark(seed + 50), 2.0);
  set(Material::kRoof, masonry(seed + 60, 512, 16, 32, 0.2, 0.06), 6.0);
  set(Material::kFoliage, foliage(seed + 70), 9.0);
  set(Material::kConcrete, clamped(0.6 + 0.05 * makeNoise(512, 1.0, seed + 80) + 0.04 * makeNoise(512, 0.3, seed + 81)),
      3.0);
  set(Material::kPoster, poster(seed + 90), 4.0);
  set(Material::kCarSide, carSide(seed + 95), 3.0);
  set(Material::kPlaster,
      clamped(0.8 + 0.012 * makeNoise(512, 1.2, seed + 97) + 0.006 * makeNoise(512, 0.3, seed + 98)), 2.5);
  for (int style = 0; style < kFacadeCount; ++style)
    textures_[static_cast<std::size_t>(Material::kFacade) + style] =
        std::make_shared<Texture>(facade(style, seed + 100 + 10 * style), scale * 12.8);
  detail_ = std::make_shared<Texture>(clamped(0.5 + 0.15 * makeNoise(512, 0.9, seed + 5)), scale * 5.3);
}

TextureSet::TextureSet(const Texture& only) : textures_(static_cast<std::size_t>(Material::kFacade) + kFacadeCount) {
  for (auto& texture : textures_) texture = std::make_shared<Texture>(only);
  detail_ = std::make_shared<Texture>(cv::Mat1f(1, 1, 0.5f), 1.0);
}

}  // namespace sdvo::render
