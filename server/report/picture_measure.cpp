#include "server/report/picture_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace strandcast {
namespace {

// shaders/lib/tone.glsl.
constexpr double kKnee = 0.7;
constexpr double kKneeRoom = 1.0 - kKnee;
constexpr double kMostShown = 0.995;  // 8 bits tell no more apart
constexpr double kBackgroundGradient = 0.35;
// Which cells count.
constexpr float kHalfHair = 0.5f;
constexpr float kMostlyHair = 0.9f;
constexpr float kNoHair = 0.02f;
constexpr float kAllSkin = 0.98f;
constexpr uint32_t kRowShare = 3;  // rows of the profile have a third of the longest one's hair at least
// Of SSIM, for values of 0 to 1.
constexpr double kSsimDeviation = 1.5;
constexpr int kSsimReach = 5;
constexpr double kSsimMean = 1e-4;
constexpr double kSsimSpread = 9e-4;
const glm::dvec3 kLuminance(0.2126, 0.7152, 0.0722);

double tone_undone(double shown) {
  const double y = std::min(shown, kMostShown);
  if (y <= kKnee) return y;
  return kKnee + kKneeRoom * (y - kKnee) / (1.0 - y);
}

double light_of_byte(uint8_t value) {
  const double shown = value / 255.0;
  return tone_undone(shown <= 0.04045 ? shown / 12.92 : std::pow((shown + 0.055) / 1.055, 2.4));
}

double shown_of_light(double light) {
  const double over = std::max(light - kKnee, 0.0);
  const double y = std::clamp(std::min(light, kKnee) + kKneeRoom * over / (over + kKneeRoom), 0.0, 1.0);
  return y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1.0 / 2.4) - 0.055;
}

glm::dvec3 shown_of(const glm::vec3& light) {
  return {shown_of_light(light.x), shown_of_light(light.y), shown_of_light(light.z)};
}

double luminance_of(const glm::dvec3& light) {
  return glm::dot(light, kLuminance);
}

/// A plane of numbers under a Gaussian; beyond its edge it goes on as at the edge.
class Plane {
 public:
  Plane(uint32_t width, uint32_t height, const std::function<double(size_t)>& value)
      : width_(width), height_(height), value_(size_t{width} * height) {
    for (size_t i = 0; i < value_.size(); ++i) value_[i] = value(i);
  }
  double at(size_t i) const { return value_[i]; }
  Plane smoothed() const { return along(true).along(false); }

 private:
  Plane along(bool is_across) const {
    std::array<double, 2 * kSsimReach + 1> weight;
    for (int k = -kSsimReach; k <= kSsimReach; ++k)
      weight[k + kSsimReach] = std::exp(-0.5 * k * k / (kSsimDeviation * kSsimDeviation));
    const double sum = std::accumulate(weight.begin(), weight.end(), 0.0);
    return Plane(width_, height_, [&](size_t i) {
      const auto x = static_cast<int>(i % width_);
      const auto y = static_cast<int>(i / width_);
      double total = 0.0;
      for (int k = -kSsimReach; k <= kSsimReach; ++k) {
        const int column = std::clamp(is_across ? x + k : x, 0, static_cast<int>(width_) - 1);
        const int row = std::clamp(is_across ? y : y + k, 0, static_cast<int>(height_) - 1);
        total += weight[k + kSsimReach] * value_[size_t(row) * width_ + column];
      }
      return total / sum;
    });
  }

  uint32_t width_, height_;
  std::vector<double> value_;
};

std::vector<double> ssim_map(const LightCells& seen, const LightCells& truth) {
  const auto plane = [&](const std::function<double(size_t)>& value) {
    return Plane(seen.width, seen.height, value);
  };
  const Plane a = plane([&](size_t i) { return luminance_of(shown_of(seen.light[i])); });
  const Plane b = plane([&](size_t i) { return luminance_of(shown_of(truth.light[i])); });
  const Plane mean_a = a.smoothed();
  const Plane mean_b = b.smoothed();
  const Plane aa = plane([&](size_t i) { return a.at(i) * a.at(i); }).smoothed();
  const Plane bb = plane([&](size_t i) { return b.at(i) * b.at(i); }).smoothed();
  const Plane ab = plane([&](size_t i) { return a.at(i) * b.at(i); }).smoothed();
  std::vector<double> map(seen.light.size());
  for (size_t i = 0; i < map.size(); ++i) {
    const double ma = mean_a.at(i);
    const double mb = mean_b.at(i);
    const double spread = aa.at(i) - ma * ma + bb.at(i) - mb * mb;
    const double both = ab.at(i) - ma * mb;
    map[i] = (2.0 * ma * mb + kSsimMean) * (2.0 * both + kSsimSpread) /
             ((ma * ma + mb * mb + kSsimMean) * (spread + kSsimSpread));
  }
  return map;
}

bool counts(const CoverCells& cover, CellPart part, size_t i) {
  if (part == CellPart::Hair) return cover.hair[i] > kHalfHair;
  return cover.hair[i] < kNoHair && cover.skin[i] > kAllSkin;
}

/// Mean luminance of hair in each row, smoothed over three rows. Rows with little hair say nothing.
std::vector<double> row_profile(const LightCells& picture, const CoverCells& cover) {
  std::vector<double> sum(picture.height, 0.0);
  std::vector<uint32_t> count(picture.height, 0);
  for (size_t i = 0; i < picture.light.size(); ++i) {
    if (cover.hair[i] <= kMostlyHair) continue;
    sum[i / picture.width] += luminance_of(picture.light[i]);
    ++count[i / picture.width];
  }
  const uint32_t most = *std::max_element(count.begin(), count.end());
  std::vector<double> rows;
  for (size_t y = 0; y < sum.size(); ++y)
    if (count[y] * kRowShare >= most) rows.push_back(sum[y] / count[y]);
  std::vector<double> smooth(rows.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    const size_t before = i > 0 ? i - 1 : i;
    const size_t behind = std::min(i + 1, rows.size() - 1);
    smooth[i] = (rows[before] + rows[i] + rows[behind]) / 3.0;
  }
  return smooth;
}

void put_shown(const std::function<glm::dvec3(size_t cell)>& color, uint32_t cells_across, Image& image) {
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      const glm::dvec3 c = color(size_t{y / kCellPx} * cells_across + x / kCellPx);
      uint8_t* const pixel = &image.rgba[(size_t{y} * image.width + x) * 4];
      for (int k = 0; k < 3; ++k) pixel[k] = static_cast<uint8_t>(std::clamp(c[k], 0.0, 1.0) * 255.0 + 0.5);
      pixel[3] = 255;
    }
}

Image blank_cells(const LightCells& cells) {
  Image image{cells.width * kCellPx, cells.height * kCellPx, {}};
  image.rgba.resize(size_t{image.width} * image.height * 4);
  return image;
}

}  // namespace

LightCells cells_of(const Image& shown, uint32_t cell_px) {
  std::array<double, 256> light;
  for (int value = 0; value < 256; ++value) light[value] = light_of_byte(static_cast<uint8_t>(value));
  LightCells cells{shown.width / cell_px, shown.height / cell_px, {}};
  for (uint32_t cell_y = 0; cell_y < cells.height; ++cell_y)
    for (uint32_t cell_x = 0; cell_x < cells.width; ++cell_x) {
      glm::dvec3 sum(0.0);
      for (uint32_t k = 0; k < cell_px * cell_px; ++k) {
        const size_t y = cell_y * cell_px + k / cell_px;
        const uint8_t* const pixel = &shown.rgba[(y * shown.width + cell_x * cell_px + k % cell_px) * 4];
        sum += glm::dvec3(light[pixel[0]], light[pixel[1]], light[pixel[2]]);
      }
      cells.light.emplace_back(sum / static_cast<double>(cell_px * cell_px));
    }
  return cells;
}

LightCells over_background(LightCells light, const CoverCells& cover, const glm::vec3& background) {
  for (size_t i = 0; i < light.light.size(); ++i) {
    const double height = 1.0 - (static_cast<double>(i / light.width) + 0.5) / light.height;
    const double bare = std::clamp(1.0 - double{cover.hair[i]} - double{cover.skin[i]}, 0.0, 1.0);
    light.light[i] +=
        background * static_cast<float>(bare * (1.0 + kBackgroundGradient * (2.0 * height - 1.0)));
  }
  return light;
}

Image shown_cells(const LightCells& cells) {
  Image image = blank_cells(cells);
  put_shown([&](size_t i) { return shown_of(cells.light[i]); }, cells.width, image);
  return image;
}

Image shown_difference(const LightCells& seen, const LightCells& truth) {
  Image image = blank_cells(seen);
  put_shown(
      [&](size_t i) {
        return glm::dvec3(0.5 + luminance_of(shown_of(seen.light[i])) -
                          luminance_of(shown_of(truth.light[i])));
      },
      seen.width, image);
  return image;
}

Result<HairFigures> hair_figures(const LightCells& picture, const CoverCells& cover) {
  HairFigures figures;
  std::vector<double> luminance;
  for (size_t i = 0; i < picture.light.size(); ++i) {
    if (cover.hair[i] <= kMostlyHair) continue;
    figures.mean += picture.light[i];
    luminance.push_back(luminance_of(picture.light[i]));
  }
  if (luminance.empty()) return make_error(ErrorCode::BadInput, "no cell of the picture is hair");
  const auto count = static_cast<double>(luminance.size());
  figures.mean /= count;
  figures.luminance = luminance_of(figures.mean);
  double square = 0.0;
  for (const double l : luminance) square += (l - figures.luminance) * (l - figures.luminance);
  figures.contrast = std::sqrt(square / count) / figures.luminance;
  const auto [least, most] = std::minmax({figures.mean.x, figures.mean.y, figures.mean.z});
  figures.saturation = 1.0 - least / most;
  std::sort(luminance.rbegin(), luminance.rend());
  const size_t hundredth = std::max<size_t>(1, luminance.size() / 100);
  figures.brightest =
      std::accumulate(luminance.begin(), luminance.begin() + static_cast<ptrdiff_t>(hundredth), 0.0) /
      static_cast<double>(hundredth);
  const std::vector<double> rows = row_profile(picture, cover);
  const auto peak = std::max_element(rows.begin(), rows.end());
  figures.glow_place = (static_cast<double>(peak - rows.begin()) + 0.5) / static_cast<double>(rows.size());
  std::vector<double> sorted = rows;
  std::sort(sorted.begin(), sorted.end());
  const double middle = 0.5 * (*peak + sorted[sorted.size() / 2]);
  const auto above = std::count_if(rows.begin(), rows.end(), [&](double row) { return row >= middle; });
  figures.glow_width = static_cast<double>(above) / static_cast<double>(rows.size());
  return figures;
}

Result<CellError> cell_error(const LightCells& seen, const LightCells& truth, const CoverCells& cover,
                             CellPart part) {
  if (seen.width != truth.width || seen.height != truth.height || seen.light.size() != cover.hair.size())
    return make_error(ErrorCode::BadInput, "{} x {} cells are compared with {} x {}", seen.width, seen.height,
                      truth.width, truth.height);
  CellError error;
  const std::vector<double> similar = ssim_map(seen, truth);
  glm::dvec3 sum_seen(0.0);
  glm::dvec3 sum_truth(0.0);
  double square = 0.0;
  for (size_t i = 0; i < seen.light.size(); ++i) {
    if (!counts(cover, part, i)) continue;
    ++error.cells;
    sum_seen += seen.light[i];
    sum_truth += truth.light[i];
    const glm::dvec3 off = shown_of(seen.light[i]) - shown_of(truth.light[i]);
    square += glm::dot(off, off) / 3.0;
    error.ssim += similar[i];
  }
  if (error.cells == 0) return error;
  error.ratio = sum_seen / sum_truth;
  error.luminance_ratio = luminance_of(sum_seen) / luminance_of(sum_truth);
  error.ssim /= error.cells;
  error.psnr_db =
      square > 0.0 ? -10.0 * std::log10(square / error.cells) : std::numeric_limits<double>::infinity();
  return error;
}

Result<double> restlessness(const std::array<LightCells, 3>& pictures, const PictureMask& mask) {
  const auto& [before, now, after] = pictures;
  const size_t count = now.light.size();
  if (before.light.size() != count || after.light.size() != count || mask.size() != count)
    return make_error(ErrorCode::BadInput, "pictures of {}, {} and {} cells are compared, by a mask of {}",
                      before.light.size(), count, after.light.size(), mask.size());
  double square = 0.0;
  size_t counted = 0;
  for (size_t i = 0; i < count; ++i) {
    if (mask[i] == 0) continue;
    const auto shown = [i](const LightCells& cells) { return luminance_of(shown_of(cells.light[i])); };
    const double second = shown(before) - 2.0 * shown(now) + shown(after);
    square += second * second;
    ++counted;
  }
  return counted > 0 ? std::sqrt(square / static_cast<double>(counted)) : 0.0;
}

}  // namespace strandcast
