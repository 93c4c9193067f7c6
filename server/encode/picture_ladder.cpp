#include "server/encode/picture_ladder.h"

#include <algorithm>
#include <array>
#include <functional>
#include <set>

namespace strandcast {
namespace {

constexpr std::array kQualities = {95, 80, 50, 30};
/// A video at half the rate has twice the change in every picture and is given as many bits for it; what is
/// saved is the rate. At half the size it is given a quarter. Tiles of hair cost more than that: it is
/// sharper per pixel (frame_bench --match yes: 0.207 bits per pixel against 0.144 at quality 30).
constexpr double kHalfSizeVideoCost = 0.25, kHalfSizeTilesCost = 0.36;

struct Point {
  double quality;
  double value;
};

/// Straight lines between the points, level beyond them.
template <size_t Count>
double interpolate(const std::array<Point, Count>& points, double quality) {
  if (quality <= points.front().quality) return points.front().value;
  for (size_t i = 1; i < Count; ++i) {
    const Point& a = points[i - 1];
    const Point& b = points[i];
    if (quality <= b.quality)
      return a.value + (b.value - a.value) * (quality - a.quality) / (b.quality - a.quality);
  }
  return points.back().value;
}

/// Of JPEG tiles, all of them, in a picture of the built-in scene (deploy/hair.png).
double jpeg_bits_per_pixel(int quality) {
  constexpr std::array<Point, 7> kMeasured = {
      {{1, 0.157}, {10, 0.179}, {30, 0.257}, {50, 0.330}, {80, 0.567}, {95, 1.295}, {100, 2.663}}};
  return interpolate(kMeasured, quality);
}

double bits_per_pixel(PictureCodec codec, int quality) {
  return is_video(codec) ? video_bits_per_pixel(quality) : jpeg_bits_per_pixel(quality);
}

}  // namespace

double video_bits_per_pixel(int quality) {
  // What VP8 has to be given in motion to look like tiles of 30, 50 and 80 (frame_bench --match yes), and
  // what it takes to look like those of 95: asked for more, it does not take all. Tiles of 1 are worse than
  // its coarsest pictures.
  constexpr std::array<Point, 6> kBits = {
      {{1, 0.03}, {30, 0.12}, {50, 0.155}, {80, 0.25}, {95, 0.51}, {100, 1.0}}};
  return interpolate(kBits, quality);
}

std::vector<PictureStep> make_picture_ladder(PictureCodec codec, int usual_quality) {
  std::set<int, std::greater<>> qualities(kQualities.begin(), kQualities.end());
  qualities.insert(usual_quality);
  const double best = bits_per_pixel(codec, *qualities.begin());
  std::vector<PictureStep> steps;
  for (const int quality : qualities) steps.push_back({quality, 1, 1, bits_per_pixel(codec, quality) / best});
  PictureStep last = steps.back();
  last.rate_divisor = 2;
  last.relative_cost /= 2.0;
  steps.push_back(last);
  last.size_divisor = 2;
  last.relative_cost *= is_video(codec) ? kHalfSizeVideoCost : kHalfSizeTilesCost;
  steps.push_back(last);
  return steps;
}

size_t find_step(const std::vector<PictureStep>& ladder, int quality) {
  const auto found = std::find_if(ladder.begin(), ladder.end(),
                                  [&](const PictureStep& step) { return step.quality == quality; });
  return found == ladder.end() ? 0 : static_cast<size_t>(found - ladder.begin());
}

}  // namespace strandcast
