#include "client/export/strand_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/math/point_tree.h"

namespace strandcast {
namespace {

/// What the simulated strands are: as many vertices each, as wide as their file says, or thinner towards the
/// tip.
ExportShape simulated_shape(const ExportScene& scene) {
  const uint32_t strands = scene.asset->strand_count;
  const uint32_t vertices = scene.asset->vertex_count;
  ExportShape shape;
  for (uint32_t strand = 0; strand <= strands; ++strand) shape.first_point.push_back(strand * vertices);
  if (scene.origin && !scene.origin->width_m.empty()) {
    shape.width_m = scene.origin->width_m;
    return shape;
  }
  for (uint32_t strand = 0; strand < strands; ++strand)
    for (uint32_t vertex = 0; vertex < vertices; ++vertex) {
      const float along = static_cast<float>(vertex) / static_cast<float>(vertices - 1);
      shape.width_m.push_back(2.0f * scene.strand_radius_m * (1.0f + (scene.tip_scale - 1.0f) * along));
    }
  return shape;
}

void append(ExportShape& shape, const ExportShape& more) {
  // Strands before these hang on themselves.
  for (auto own = static_cast<uint32_t>(shape.guides.size()); own + 1 < shape.first_point.size(); ++own)
    shape.guides.push_back({glm::uvec3(own)});
  shape.guides.insert(shape.guides.end(), more.guides.begin(), more.guides.end());
  const auto first = static_cast<uint32_t>(shape.width_m.size());
  for (size_t strand = shape.first_point.empty() ? 0 : 1; strand < more.first_point.size(); ++strand)
    shape.first_point.push_back(first + more.first_point[strand]);
  shape.width_m.insert(shape.width_m.end(), more.width_m.begin(), more.width_m.end());
}

template <class Point>
double length_of(std::span<const Point> points) {
  double length = 0.0;
  for (size_t i = 1; i < points.size(); ++i)
    length += glm::distance(glm::dvec3(points[i - 1]), glm::dvec3(points[i]));
  return length;
}

}  // namespace

StrandSet::StrandSet(const ExportScene& scene, const ExportOptions& options, const PosedStrands& first)
    : scene_(scene), options_(options), first_pose_(first.world_from_head) {
  if (!scene.drawing || options.role == ExportRole::Followers) {
    key_count_ = scene.asset->strand_count;
    shape_ = simulated_shape(scene);
  }
  if (scene.drawing) append(shape_, scene.drawing->shape());
  const std::vector<glm::vec3> rest_m = in_head(scene.asset->rest_position_m);
  const std::vector<glm::vec3> first_m = in_head(first.position_m);
  const auto unit_m = static_cast<float>(options.unit_m);
  for (const Member& member : members_of_all(rest_m)) {
    const uint32_t begin = shape_.first_point[member.strand];
    const uint32_t count = shape_.first_point[member.strand + 1] - begin;
    const auto length_m = [&](std::span<const glm::vec3> points) {
      return length_of(points.subspan(begin, count));
    };
    if (std::min(length_m(rest_m), length_m(first_m)) < kLeastExportedLengthM) {
      ++left_out_count_;
      continue;
    }
    members_.push_back(member);
    vertex_counts_.push_back(count);
    vertex_count_ = std::max(vertex_count_, count);
    for (uint32_t i = begin; i < begin + count; ++i) width_.push_back(shape_.width_m[i] / unit_m);
  }
}

const std::vector<glm::vec3>& StrandSet::rest_position_m(const ExportScene& scene) {
  const bool is_known = scene.origin && !scene.origin->rest_position_m.empty();
  return is_known ? scene.origin->rest_position_m : scene.asset->rest_position_m;
}

/// Simulated strands in the order of their files; drawn ones go with the simulated strand whose root is
/// nearest.
std::vector<StrandSet::Member> StrandSet::members_of_all(std::span<const glm::vec3> rest_m) const {
  const auto strands = static_cast<uint32_t>(shape_.first_point.size() - 1);
  std::vector<Member> members(key_count_);
  for (uint32_t key = 0; key < key_count_; ++key) {
    const uint32_t place = scene_.origin ? scene_.origin->place[key] : key;
    members[place] = {key, key, true};
  }
  const std::span<const glm::vec3> roots(scene_.asset->rest_position_m.data(), scene_.asset->strand_count);
  const PointTree tree(roots);
  for (uint32_t strand = key_count_; strand < strands; ++strand) {
    const uint32_t key =
        scene_.origin ? tree.nearest(rest_m[shape_.first_point[strand]], 1).front().index : 0;
    members.push_back({strand, key, false});
  }
  return members;
}

/// Points of all strands, strand after strand.
std::vector<glm::vec3> StrandSet::in_head(const std::vector<glm::vec3>& position_m) const {
  std::vector<glm::vec3> points;
  points.reserve(shape_.width_m.size());
  for (size_t strand = 0; strand < key_count_; ++strand)
    for (size_t i = strand; i < position_m.size(); i += key_count_) points.push_back(position_m[i]);
  if (!scene_.drawing) return points;
  std::vector<glm::vec3> drawn = scene_.drawing->points(position_m);
  if (points.empty()) return drawn;
  points.insert(points.end(), drawn.begin(), drawn.end());
  return points;
}

glm::dvec3 StrandSet::in_file(const glm::vec3& point_in_head, const Pose& world_from_head) const {
  const glm::dvec3 placed = options_.space == ExportSpace::World ? world_from_head * glm::dvec3(point_in_head)
                                                                 : glm::dvec3(point_in_head);
  if (options_.file_from_space) return *options_.file_from_space * glm::dvec4(placed, 1.0);
  const glm::dvec3 p = placed / options_.unit_m;
  return options_.up == ExportUp::Z ? glm::dvec3(p.x, -p.z, p.y) : p;
}

std::vector<glm::dvec3> StrandSet::points(const PosedStrands& strands) const {
  const std::vector<glm::vec3> all = in_head(strands.position_m);
  std::vector<glm::dvec3> points;
  points.reserve(width_.size());
  for (const Member& member : members_)
    for (uint32_t i = shape_.first_point[member.strand]; i < shape_.first_point[member.strand + 1]; ++i)
      points.push_back(in_file(all[i], strands.world_from_head));
  return points;
}

std::vector<glm::vec2> StrandSet::root_uv() const {
  constexpr auto kPi = std::numbers::pi_v<float>;
  std::vector<glm::vec2> uv;
  uv.reserve(members_.size());
  if (scene_.origin && !scene_.origin->root_uv.empty()) {
    for (const Member& member : members_) uv.push_back(scene_.origin->root_uv[member.key]);
    return uv;
  }
  const std::vector<glm::vec3> rest_m = in_head(scene_.asset->rest_position_m);
  const auto root = [&](const Member& member) { return rest_m[shape_.first_point[member.strand]]; };
  glm::dvec3 middle(0.0);
  for (const Member& member : members_) middle += glm::dvec3(root(member));
  middle /= std::max(1.0, static_cast<double>(members_.size()));
  for (const Member& member : members_) {
    const glm::vec3 out = root(member) - glm::vec3(middle);
    const float length = glm::length(out);
    const float up = length > 0.0f ? std::clamp(out.y / length, -1.0f, 1.0f) : 1.0f;
    uv.emplace_back(0.5f + std::atan2(out.x, out.z) / (2.0f * kPi), 0.5f + std::asin(up) / kPi);
  }
  return uv;
}

std::vector<int32_t> StrandSet::ids() const {
  const bool has_ids = scene_.origin && !scene_.origin->id.empty();
  uint32_t next = 0;
  if (has_ids && key_count_ > 0)
    next = 1u + static_cast<uint32_t>(*std::ranges::max_element(scene_.origin->id));
  std::vector<int32_t> ids;
  for (const Member& member : members_)
    ids.push_back(has_ids && member.is_key ? scene_.origin->id[member.key] : static_cast<int32_t>(next++));
  return ids;
}

std::vector<int32_t> StrandSet::groups() const {
  const bool has_groups = scene_.origin && !scene_.origin->group.empty();
  std::vector<int32_t> groups;
  for (const Member& member : members_) groups.push_back(has_groups ? scene_.origin->group[member.key] : 0);
  return groups;
}

std::vector<int16_t> StrandSet::guides() const {
  std::vector<int16_t> guides;
  for (const Member& member : members_)
    guides.push_back(options_.role == ExportRole::Guides ||
                     (options_.role == ExportRole::Followers && member.is_key));
  return guides;
}

StrandSet::Influence StrandSet::influence() const {
  Influence influence;
  if (options_.role != ExportRole::Followers || shape_.guides.size() + 1 != shape_.first_point.size())
    return influence;
  const std::vector<int32_t> ids = this->ids();
  std::vector<std::optional<int32_t>> id_of_key(key_count_);  // of those that are not left out
  for (size_t i = 0; i < members_.size(); ++i)
    if (members_[i].is_key) id_of_key[members_[i].key] = ids[i];
  for (const Member& member : members_) {
    const ExportGuides& guides = shape_.guides[member.strand];
    float sum = 0.0f;
    for (int k = 0; k < 3; ++k)
      if (id_of_key[guides.strand[k]]) sum += guides.share[k];
    for (int k = 0; k < 3; ++k) {
      const std::optional<int32_t> id = id_of_key[guides.strand[k]];
      influence.id.push_back(id.value_or(0));
      influence.share.push_back(id && sum > 0.0f ? guides.share[k] / sum : 0.0f);
    }
  }
  return influence;
}

std::vector<std::string> StrandSet::names() const {
  std::vector<std::string> names;
  if (!scene_.origin || scene_.origin->object.empty()) return names;
  for (const Member& member : members_)
    names.push_back(scene_.origin->object_name[scene_.origin->object[member.key]]);
  return names;
}

HairMaterial StrandSet::material() const {
  return scene_.origin ? scene_.origin->material.scaled(1.0 / options_.unit_m) : HairMaterial{};
}

uint32_t StrandSet::collapsed_count(std::span<const glm::dvec3> points) const {
  uint32_t collapsed = 0;
  size_t begin = 0;
  for (const uint32_t count : vertex_counts_) {
    if (length_of(points.subspan(begin, count)) * options_.unit_m < kLeastExportedLengthM) ++collapsed;
    begin += count;
  }
  return collapsed;
}

std::vector<glm::dvec3> StrandSet::head_points(const Pose& world_from_head) const {
  std::vector<glm::dvec3> points;
  if (options_.has_head)
    for (const glm::vec3& point : scene_.asset->head.position_m)
      points.push_back(in_file(point, world_from_head));
  return points;
}

std::span<const glm::uvec3> StrandSet::head_triangles() const {
  if (!options_.has_head) return {};
  return scene_.asset->head.triangle;
}

}  // namespace strandcast
