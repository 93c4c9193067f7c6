#include "common/groom/distance_field.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "common/groom/winding_tree.h"

namespace strandcast {
namespace {

/// Beside the mesh: cells, and more where these are small.
constexpr double kMarginCells = 2.0;
constexpr double kMostMarginCells = 16.0;
constexpr double kMarginM = 0.002;
/// Distances are exact up to here: strands look up cells that lie within half a millimetre of the skin.
constexpr double kBandCells = 2.0;
constexpr double kBandM = 0.0006;
/// So much larger than computed is a ball about a triangle, for roundings.
constexpr double kRoundedUp = 1.0 + 1e-6;
/// Winding numbers farther than this from what closed meshes have (0, 1, 2 ...) are in doubt, and nodes near
/// the surface of which at most such a share may be in doubt, or inside of what is inside out.
constexpr double kDoubt = 0.25;
constexpr double kMostDoubtShare = 0.2;
constexpr double kMostInsideOutShare = 0.05;
/// Signs are found for blocks of nodes of this edge at once.
constexpr uint32_t kBlock = 4;
/// The value of a node beside a hole, in cells: the surface that is not there lies halfway.
constexpr float kMembraneCells = 0.5f;

class FieldMaker {
 public:
  FieldMaker(std::vector<Triangle> triangles, uint32_t resolution, WorkerPool& workers)
      : triangles_(std::move(triangles)), workers_(workers), tree_(triangles_) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const Triangle& triangle : triangles_)
      for (const glm::dvec3& corner : triangle) low = glm::min(low, corner), high = glm::max(high, corner);
    const glm::dvec3 size = high - low;
    cell_m_ = std::max({size.x, size.y, size.z}) / resolution;
    const double margin_m = std::clamp(kMarginM, kMarginCells * cell_m_, kMostMarginCells * cell_m_);
    origin_m_ = low - margin_m;
    count_ = glm::uvec3(glm::ceil((size + 2.0 * margin_m) / cell_m_)) + 1u;
  }

  uint64_t node_total() const { return uint64_t{count_.x} * count_.y * count_.z; }

  Result<DistanceField> make() {
    distance_m_.assign(node_total(), std::numeric_limits<float>::infinity());
    is_inside_.assign(node_total(), 0);
    find_band();
    find_signs();
    RETURN_IF_ERROR(check_signs());
    close_holes();
    sweep();
    return pack();
  }

 private:
  size_t index_of(uint32_t x, uint32_t y, uint32_t z) const {
    return (size_t{z} * count_.y + y) * count_.x + x;
  }
  glm::dvec3 point_of(const glm::dvec3& node) const { return origin_m_ + cell_m_ * node; }

  /// First and last node along an axis within a range.
  std::pair<uint32_t, uint32_t> nodes_within(double low_m, double high_m, int axis) const {
    const double last = count_[axis] - 1.0;
    const double low = std::ceil((low_m - origin_m_[axis]) / cell_m_);
    const double high = std::floor((high_m - origin_m_[axis]) / cell_m_);
    if (high < 0.0 || low > last) return {1, 0};
    return {static_cast<uint32_t>(std::clamp(low, 0.0, last)),
            static_cast<uint32_t>(std::clamp(high, 0.0, last))};
  }

  /// Exact distances in the band about each triangle.
  void find_band() {
    band_m_ = kBandCells * cell_m_ + std::min(kBandM, kBandCells * cell_m_);
    workers_.at(Priority::Background).for_ranges(count_.z, 2, [&](size_t begin, size_t end) {
      for (const Triangle& triangle : triangles_)
        add_triangle(triangle, static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
    });
  }

  void add_triangle(const Triangle& triangle, uint32_t begin, uint32_t end) {
    const auto& [a, b, c] = triangle;
    const glm::dvec3 low = glm::min(glm::min(a, b), c) - band_m_;
    const glm::dvec3 high = glm::max(glm::max(a, b), c) + band_m_;
    auto [z_first, z_last] = nodes_within(low.z, high.z, 2);
    if (z_first > z_last || z_first >= end || z_last < begin) return;
    z_first = std::max(z_first, begin);
    z_last = std::min(z_last, end - 1);
    const auto [y_first, y_last] = nodes_within(low.y, high.y, 1);
    if (y_first > y_last) return;
    const glm::dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
    const glm::dvec3 middle = (a + b + c) / 3.0;
    const double reach_m =
        kRoundedUp * std::max({glm::distance(middle, a), glm::distance(middle, b), glm::distance(middle, c)});
    for (uint32_t z = z_first; z <= z_last; ++z)
      for (uint32_t y = y_first; y <= y_last; ++y) {
        // Of the row only what is near the triangle's plane.
        double row_low = low.x, row_high = high.x;
        const glm::dvec3 row = point_of(glm::dvec3(0.0, y, z));
        const double offset = glm::dot(normal, row - a);
        if (std::abs(normal.x) > 1e-6) {
          const double near = row.x + (-offset - std::copysign(band_m_, normal.x)) / normal.x;
          const double far = row.x + (-offset + std::copysign(band_m_, normal.x)) / normal.x;
          row_low = std::max(row_low, near);
          row_high = std::min(row_high, far);
        } else if (std::abs(offset) > band_m_ + 1e-6 * cell_m_ * count_.x) {
          continue;
        }
        const auto [x_first, x_last] = nodes_within(row_low, row_high, 0);
        for (uint32_t x = x_first; x <= x_last && x_first <= x_last; ++x) {
          const glm::dvec3 point = point_of(glm::dvec3(x, y, z));
          float& least = distance_m_[index_of(x, y, z)];
          // Most triangles lie in a ball that is further away than one that came before.
          if (glm::distance(point, middle) - reach_m > static_cast<double>(least)) continue;
          const double distance = distance_to_triangle_m(point, a, b, c);
          if (distance <= band_m_) least = std::min(least, static_cast<float>(distance));
        }
      }
  }

  /// Blocks that no surface is near have one sign, that of their middle. In others neighbours have the same
  /// where balls about them that no triangle reaches into meet, unless a hole is near.
  void find_signs() {
    const glm::uvec3 blocks = (count_ + kBlock - 1u) / kBlock;
    workers_.at(Priority::Background)
        .for_ranges(size_t{blocks.x} * blocks.y * blocks.z, 4, [&](size_t begin, size_t end) {
          for (size_t i = begin; i < end; ++i) {
            const glm::uvec3 block(i % blocks.x, i / blocks.x % blocks.y, i / blocks.x / blocks.y);
            sign_block(block * kBlock, glm::min(block * kBlock + kBlock, count_));
          }
        });
  }

  void sign_block(const glm::uvec3& first, const glm::uvec3& end) {
    bool has_band = false;
    for (uint32_t z = first.z; z < end.z; ++z)
      for (uint32_t y = first.y; y < end.y; ++y)
        for (uint32_t x = first.x; x < end.x; ++x) has_band |= distance_m_[index_of(x, y, z)] <= band_m_;
    if (!has_band) {
      const double winding =
          tree_.winding_number(point_of(0.5 * (glm::dvec3(first) + glm::dvec3(end) - 1.0)));
      if (!is_in_doubt(winding)) return fill(first, end, winding > 0.5);
    }
    std::array<bool, kBlock * kBlock * kBlock> is_sure{};
    const auto in_block = [&](uint32_t x, uint32_t y, uint32_t z) {
      return ((z - first.z) * kBlock + (y - first.y)) * kBlock + (x - first.x);
    };
    uint32_t near_count = 0, doubt_count = 0, inside_out_count = 0;
    for (uint32_t z = first.z; z < end.z; ++z)
      for (uint32_t y = first.y; y < end.y; ++y)
        for (uint32_t x = first.x; x < end.x; ++x) {
          const size_t at = index_of(x, y, z);
          near_count += distance_m_[at] <= cell_m_ ? 1 : 0;
          const auto takes_from = [&](uint32_t u, uint32_t v, uint32_t w) {
            const size_t other = index_of(u, v, w);
            if (!is_sure[in_block(u, v, w)] || !(distance_m_[at] + distance_m_[other] > cell_m_ * 1.001))
              return false;
            is_inside_[at] = is_inside_[other];
            return is_sure[in_block(x, y, z)] = true;
          };
          if ((x > first.x && takes_from(x - 1, y, z)) || (y > first.y && takes_from(x, y - 1, z)) ||
              (z > first.z && takes_from(x, y, z - 1)))
            continue;
          const double winding = tree_.winding_number(point_of(glm::dvec3(x, y, z)));
          is_inside_[at] = winding > 0.5 ? 1 : 0;
          is_sure[in_block(x, y, z)] = !is_in_doubt(winding);
          if (distance_m_[at] <= cell_m_) {
            doubt_count += is_in_doubt(winding) ? 1 : 0;
            inside_out_count += winding < -0.5 ? 1 : 0;
          }
        }
    near_count_ += near_count;
    doubt_count_ += doubt_count;
    inside_out_count_ += inside_out_count;
  }

  void fill(const glm::uvec3& first, const glm::uvec3& end, bool is_inside) {
    for (uint32_t z = first.z; z < end.z; ++z)
      for (uint32_t y = first.y; y < end.y; ++y)
        for (uint32_t x = first.x; x < end.x; ++x) is_inside_[index_of(x, y, z)] = is_inside ? 1 : 0;
  }

  static bool is_in_doubt(double winding) { return std::abs(winding - std::round(winding)) > kDoubt; }

  Status check_signs() const {
    const double near = std::max<double>(1.0, near_count_);
    if (doubt_count_ > kMostDoubtShare * near)
      return make_error(ErrorCode::BadInput,
                        "the mesh is too open: for {:.0f} % of what is near it nobody can say whether it is "
                        "inside (at most {:.0f} %)",
                        100.0 * doubt_count_ / near, 100.0 * kMostDoubtShare);
    if (inside_out_count_ > kMostInsideOutShare * near)
      return make_error(
          ErrorCode::BadInput,
          "the mesh intersects itself or is inside out in parts: {:.0f} % of what is near it lies "
          "inside of triangles that face inwards (at most {:.0f} %)",
          100.0 * inside_out_count_ / near, 100.0 * kMostInsideOutShare);
    if (std::find(is_inside_.begin(), is_inside_.end(), 1) == is_inside_.end())
      return make_error(ErrorCode::BadInput, "the mesh has no inside at this resolution");
    return {};
  }

  /// Where the sign changes and no triangle is, the surface lies halfway.
  void close_holes() {
    std::vector<size_t> beside;
    const auto look = [&](size_t a, size_t b) {
      if (is_inside_[a] == is_inside_[b] || distance_m_[a] + distance_m_[b] <= cell_m_ * 1.001) return;
      beside.push_back(a);
      beside.push_back(b);
    };
    for (uint32_t z = 0; z < count_.z; ++z)
      for (uint32_t y = 0; y < count_.y; ++y)
        for (uint32_t x = 0; x < count_.x; ++x) {
          if (x + 1 < count_.x) look(index_of(x, y, z), index_of(x + 1, y, z));
          if (y + 1 < count_.y) look(index_of(x, y, z), index_of(x, y + 1, z));
          if (z + 1 < count_.z) look(index_of(x, y, z), index_of(x, y, z + 1));
        }
    for (const size_t node : beside)
      distance_m_[node] = std::min(distance_m_[node], kMembraneCells * static_cast<float>(cell_m_));
  }

  /// Distances beyond the band: fast sweeping (Zhao 2005) in eight orders.
  void sweep() {
    is_open_.resize(distance_m_.size());
    for (size_t i = 0; i < distance_m_.size(); ++i) is_open_[i] = std::isinf(distance_m_[i]) ? 1 : 0;
    for (int order = 0; order < 8; ++order) {
      const auto along = [&](uint32_t i, uint32_t count, int bit) {
        return (order >> bit & 1) != 0 ? count - 1 - i : i;
      };
      for (uint32_t k = 0; k < count_.z; ++k)
        for (uint32_t j = 0; j < count_.y; ++j)
          for (uint32_t i = 0; i < count_.x; ++i)
            update(along(i, count_.x, 0), along(j, count_.y, 1), along(k, count_.z, 2));
    }
  }

  void update(uint32_t x, uint32_t y, uint32_t z) {
    const size_t at = index_of(x, y, z);
    if (is_open_[at] == 0) return;
    const auto nearer = [&](uint32_t i, uint32_t count, size_t stride) {
      const float before = i > 0 ? distance_m_[at - stride] : std::numeric_limits<float>::infinity();
      const float after = i + 1 < count ? distance_m_[at + stride] : std::numeric_limits<float>::infinity();
      return std::min(before, after);
    };
    std::array<float, 3> near = {nearer(x, count_.x, 1), nearer(y, count_.y, count_.x),
                                 nearer(z, count_.z, size_t{count_.x} * count_.y)};
    if (near[0] > near[1]) std::swap(near[0], near[1]);
    if (near[1] > near[2]) std::swap(near[1], near[2]);
    if (near[0] > near[1]) std::swap(near[0], near[1]);
    if (std::isinf(near[0])) return;
    const auto h = static_cast<float>(cell_m_);
    float distance = near[0] + h;
    if (distance > near[1]) {
      const float gap = near[0] - near[1];
      distance = 0.5f * (near[0] + near[1] + std::sqrt(2.0f * h * h - gap * gap));
      if (distance > near[2]) {
        const float sum = near[0] + near[1] + near[2];
        const float squares = near[0] * near[0] + near[1] * near[1] + near[2] * near[2];
        distance = (sum + std::sqrt(std::max(sum * sum - 3.0f * (squares - h * h), 0.0f))) / 3.0f;
      }
    }
    distance_m_[at] = std::min(distance_m_[at], distance);
  }

  DistanceField pack() const {
    DistanceField field;
    field.origin_m = glm::vec3(origin_m_);
    field.cell_m = static_cast<float>(cell_m_);
    field.node_count = count_;
    field.quad.resize(distance_m_.size());
    workers_.at(Priority::Background).for_ranges(count_.z, 4, [&](size_t begin, size_t end) {
      for (auto z = static_cast<uint32_t>(begin); z < end; ++z)
        for (uint32_t y = 0; y < count_.y; ++y)
          for (uint32_t x = 0; x < count_.x; ++x) {
            const uint32_t right = std::min(x + 1, count_.x - 1), up = std::min(y + 1, count_.y - 1);
            field.quad[index_of(x, y, z)] = {signed_at(index_of(x, y, z)), signed_at(index_of(right, y, z)),
                                             signed_at(index_of(x, up, z)),
                                             signed_at(index_of(right, up, z))};
          }
    });
    return field;
  }
  float signed_at(size_t at) const { return is_inside_[at] != 0 ? -distance_m_[at] : distance_m_[at]; }

  const std::vector<Triangle> triangles_;
  WorkerPool& workers_;
  const WindingTree tree_;
  glm::dvec3 origin_m_{0.0};
  double cell_m_ = 0.0;
  double band_m_ = 0.0;
  glm::uvec3 count_{0};
  std::vector<float> distance_m_;         // by node, without sign
  std::vector<uint8_t> is_inside_;        // by node
  std::vector<uint8_t> is_open_;          // by node: not in the band
  std::atomic<uint32_t> near_count_ = 0;  // nodes within a cell of the surface
  std::atomic<uint32_t> doubt_count_ = 0;
  std::atomic<uint32_t> inside_out_count_ = 0;
};

/// Those with an area, each from its least corner on, in one order whatever that of the mesh, and turned so
/// that the whole faces outwards.
std::vector<Triangle> triangles_of(const Mesh& mesh) {
  const auto is_less = [](const glm::dvec3& a, const glm::dvec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  };
  std::vector<Triangle> triangles;
  for (const glm::uvec3& corner : mesh.triangle) {
    Triangle triangle = {glm::dvec3(mesh.position_m[corner.x]), glm::dvec3(mesh.position_m[corner.y]),
                         glm::dvec3(mesh.position_m[corner.z])};
    const glm::dvec3 along = triangle[1] - triangle[0], across = triangle[2] - triangle[0];
    const double area = glm::length(glm::cross(along, across));
    const double side = std::max({glm::dot(along, along), glm::dot(across, across)});
    if (!(area > 1e-9 * side)) continue;
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end(), is_less),
                triangle.end());
    triangles.push_back(triangle);
  }
  std::sort(triangles.begin(), triangles.end(), [&](const Triangle& a, const Triangle& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), is_less);
  });
  if (triangles.empty()) return triangles;
  glm::dvec3 middle(0.0);
  for (const Triangle& triangle : triangles) middle += triangle[0];
  middle /= static_cast<double>(triangles.size());
  double volume = 0.0;
  for (const auto& [a, b, c] : triangles) volume += glm::dot(a - middle, glm::cross(b - middle, c - middle));
  if (volume < 0.0)
    for (Triangle& triangle : triangles) std::swap(triangle[1], triangle[2]);
  return triangles;
}

}  // namespace

double distance_to_triangle_m(const glm::dvec3& point_m, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c) {
  // Ericson 2005, "Real-Time Collision Detection", 5.1.5: the region of the plane that the point is over.
  const glm::dvec3 ab = b - a, ac = c - a, ap = point_m - a, bp = point_m - b, cp = point_m - c;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return glm::length(ap);
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return glm::length(bp);
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return glm::length(cp);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return glm::length(ap - d1 / (d1 - d3) * ab);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return glm::length(ap - d2 / (d2 - d6) * ac);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) return glm::length(bp - (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b));
  const double inverse = 1.0 / (va + vb + vc);
  return glm::length(ap - (vb * inverse) * ab - (vc * inverse) * ac);
}

DistanceField::Sample DistanceField::sample(const glm::dvec3& point_m) const {
  const glm::dvec3 last(node_count - 1u);
  const glm::dvec3 at =
      glm::clamp((point_m - glm::dvec3(origin_m)) / static_cast<double>(cell_m), glm::dvec3(0.0), last);
  const glm::dvec3 cell = glm::min(glm::floor(at), last - 1.0);
  const glm::dvec3 f = at - cell;
  const glm::uvec3 node(cell);
  const size_t index = (size_t{node.z} * node_count.y + node.y) * node_count.x + node.x;
  const glm::dvec4 low(quad[index]), high(quad[index + size_t{node_count.x} * node_count.y]);
  const glm::dvec4 rise = high - low, here = low + f.z * rise;
  const auto between = [&](const glm::dvec4& v) {
    return glm::mix(glm::mix(v.x, v.y, f.x), glm::mix(v.z, v.w, f.x), f.y);
  };
  const glm::dvec3 slope = {glm::mix(here.y - here.x, here.w - here.z, f.y),
                            glm::mix(here.z - here.x, here.w - here.y, f.x), between(rise)};
  return {between(here), slope / static_cast<double>(cell_m)};
}

Result<DistanceField> make_distance_field(const Mesh& mesh, uint32_t resolution, WorkerPool& workers) {
  if (resolution < kMinFieldResolution || resolution > kMaxFieldResolution)
    return make_error(ErrorCode::BadInput, "{} cells along the longest side, {} to {} are allowed",
                      resolution, kMinFieldResolution, kMaxFieldResolution);
  for (const glm::vec3& point : mesh.position_m)
    if (!(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)))
      return make_error(ErrorCode::BadInput, "a vertex of the mesh is at no finite place");
  for (const glm::uvec3& triangle : mesh.triangle)
    if (std::max({triangle.x, triangle.y, triangle.z}) >= mesh.position_m.size())
      return make_error(ErrorCode::BadInput, "a triangle of the mesh has a corner that is not there");
  std::vector<Triangle> triangles = triangles_of(mesh);
  if (triangles.empty())
    return make_error(ErrorCode::BadInput, "the mesh has no triangles with an area to make a field of");
  FieldMaker maker(std::move(triangles), resolution, workers);
  if (maker.node_total() * sizeof(glm::vec4) > kMaxFieldBytes)
    return make_error(ErrorCode::LimitExceeded, "the field would take {} MiB, at most {} are allowed",
                      maker.node_total() * sizeof(glm::vec4) >> 20, kMaxFieldBytes >> 20);
  return maker.make();
}

}  // namespace strandcast
