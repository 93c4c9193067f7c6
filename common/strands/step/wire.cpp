#include "common/strands/step/wire.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/strands/step/graded_field.h"
#include "common/strands/step/numbers.h"
#include "common/strands/step/rod_planes.h"
#include "common/strands/step/tip_mask.h"
#include "common/strands/strand_limits.h"
#include "common/strands/strand_payload.h"
#include "common/strands/wrapping.h"

namespace strandcast::step {
namespace {

constexpr double kWindStepMps = 1.0 / 16384.0;
constexpr auto kMostWindSteps = static_cast<int32_t>(kMaxWindMps / kWindStepMps);
constexpr size_t kMostConstants = 24;
constexpr size_t kMostNameBytes = 40;
constexpr float kDirectionStep = 1.0f / 8192.0f;  // of what a rod is told beside its rest shape
constexpr uint32_t kDroppedBits = 12;             // of a stiffness
constexpr float kMostStiffness = 1e12f;
constexpr double kMostTipLengthM = 1e3;
constexpr double kLargest = 1e20;  // of parameters and constants
constexpr uint8_t kVolume = 0x80;  // beside a kernel's number
constexpr uint8_t kPasses = 0x40, kMixedTips = 0x20;
// Of the passes.
constexpr uint8_t kBend = 1, kDrag = 2, kMeetsBody = 4, kField = 8, kGradedField = 16;
constexpr uint8_t kSceneBody = 0x80;  // beside the substeps
constexpr uint8_t kSceneBust = 0x80;  // beside the count of colliders
constexpr double kMostBustShare = 1e4;
constexpr double kMostCellM = 1.0;
constexpr double kBodyStepM = 1.0 / 65536.0;
constexpr auto kMostBodySteps = static_cast<int32_t>(kMaxColliderM / kBodyStepM);
constexpr double kMostNormal = 1.001;
constexpr double kMostForcePerS2 = 1e6;
constexpr double kMostVolumeRate = 1e6;
constexpr double kMostHairs = 1e7;
constexpr double kMostHairRadiusM = 1.0;
constexpr double kMostHairDensityKgpm3 = 1e6;
// Flags of a volume.
constexpr uint8_t kImplicit = 1;
constexpr uint8_t kAir = 2;
constexpr uint8_t kAirWind = 4;  // some of it is kept off
constexpr double kMostWindWidthM = 1.0;
constexpr double kMostDensityScale = 100.0;
constexpr uint8_t kWaves = 1;
constexpr uint8_t kCarried = 2;
constexpr uint8_t kCarriedElsewhere = 4;  // not to where the tick ends
constexpr uint8_t kTickBody = 8;
constexpr uint8_t kTickNewBody = 16;
constexpr uint8_t kTickBust = 32;
constexpr uint8_t kSteadyWind = 64;  // as in the tick before
constexpr uint8_t kTickFlags =
    kWaves | kCarried | kCarriedElsewhere | kTickBody | kTickNewBody | kTickBust | kSteadyWind;
/// Bits of each angle of a chest, from the lowest bit of its code.
constexpr std::array<uint32_t, 3> kChestBits = {12, 10, 10};

/// Writes and reads vectors, and remembers whether all that was read were usable numbers.
struct Numbers {
  ByteReader& bytes;
  bool are_usable = true;

  template <class T>
  T take(double most) {
    const T value = bytes.take<T>();
    are_usable &= std::isfinite(value) && std::abs(static_cast<double>(value)) <= most;
    return value;
  }
  template <class T, class Vector>
  Vector vector(double most) {
    const T x = take<T>(most);
    const T y = take<T>(most);
    const T z = take<T>(most);
    return {x, y, z};
  }
  Status status(const char* what) const {
    if (!bytes.ok()) return make_error(ErrorCode::BadInput, "{} of a step is cut off", what);
    if (!are_usable)
      return make_error(ErrorCode::BadInput, "{} of a step has numbers that none can be", what);
    return {};
  }
};

template <class Vector>
void put_vector(const Vector& vector, ByteWriter& to) {
  to.put(vector.x);
  to.put(vector.y);
  to.put(vector.z);
}

/// What of a rod is told beside what follows from the rest shape, in the order of strands.
template <class Code>
void code_rods(StepModel& model, uint32_t strand_count, const RodPlanes& natural, Code code) {
  const bool has_tail = model.pinned_tail_count > 0;
  const auto code_vector = [&](glm::vec4& value, const glm::vec4& expected) {
    for (int axis = 0; axis < 3; ++axis) code(value[axis], expected[axis], axis);
  };
  for (uint32_t s = 0; s < strand_count; ++s)
    for (uint32_t row = 0; row < (has_tail ? kRodStrandRows : 2u); ++row)
      code_vector(model.rod_strand[size_t{row} * model.strand_count + s],
                  natural.strand[size_t{row} * strand_count + s]);
  for (uint32_t s = 0; s < strand_count; ++s)
    for (uint32_t v = model.pinned_root_count + 1; v < model.vertex_count; ++v)
      code_vector(model.rod_edge[size_t{v} * model.strand_count + s],
                  natural.edge[size_t{v} * strand_count + s]);
}

/// First bits of a positive float.
int32_t first_bits(float value) {
  return static_cast<int32_t>(glm::floatBitsToUint(std::max(value, 0.0f)) >> kDroppedBits);
}
float of_first_bits(int32_t bits) {
  const float value = glm::uintBitsToFloat(static_cast<uint32_t>(bits) << kDroppedBits);
  return value >= 0.0f && value < kMostStiffness ? value : 0.0f;
}

/// What tells how the rods of a model lie in their rest shape.
struct RodsTold {
  std::span<const glm::vec3> rest_in_head_m;
  uint32_t strand_count;
  std::span<const uint8_t> has_tail;  // of these strands
  double twist_over_bend = 0.0;
  glm::vec3 weight_mps2{0.0f};
  std::vector<float> bend_m4ps2 = {};
};
RodPlanes natural_rods_of(const StepModel& model, const RodsTold& told) {
  const bool has_twist = model.kernel.variant_of("HAS_TWIST") != 0;
  RodShapes shapes{told.rest_in_head_m,     told.strand_count, model.vertex_count, model.pinned_root_count,
                   model.pinned_tail_count, told.has_tail,     has_twist};
  shapes.weight_mps2 = told.weight_mps2;
  shapes.twist_over_bend = told.twist_over_bend;
  shapes.bend_m4ps2 = told.bend_m4ps2;
  const auto tip = model.kernel.constants.find("u_tip_length");
  if (tip != model.kernel.constants.end() && std::holds_alternative<double>(tip->second))
    shapes.tip_length_m = std::clamp(std::get<double>(tip->second), 0.0, kMostTipLengthM);
  return natural_rods(shapes);
}

/// The weight that rods carry in their rest shape: the sixteenths of gravity that foretell a few of them
/// best.
glm::vec3 carried_weight(const StepModel& model, const RodsTold& told, const glm::dvec3& gravity_mps2) {
  constexpr uint32_t kSample = 16;
  constexpr int kShares = 16;
  const uint32_t count = std::min(told.strand_count, kSample);
  std::vector<glm::vec3> rest_in_head_m(size_t{count} * model.vertex_count);
  const auto strand_of = [&](uint32_t i) { return i * (told.strand_count / count); };
  std::vector<uint8_t> has_tail(told.has_tail.empty() ? 0 : count);
  for (uint32_t i = 0; i < has_tail.size(); ++i) has_tail[i] = told.has_tail[strand_of(i)];
  RodsTold sample{rest_in_head_m, count, has_tail, told.twist_over_bend};
  for (uint32_t i = 0; i < count; ++i) {
    sample.bend_m4ps2.push_back(told.bend_m4ps2[strand_of(i)]);
    for (uint32_t v = 0; v < model.vertex_count; ++v)
      rest_in_head_m[size_t{v} * count + i] =
          told.rest_in_head_m[size_t{v} * told.strand_count + strand_of(i)];
  }
  glm::vec3 best(0.0f);
  float least = std::numeric_limits<float>::infinity();
  for (int share = 0; share <= kShares; ++share) {
    sample.weight_mps2 = glm::vec3(gravity_mps2 * (static_cast<double>(share) / kShares));
    const RodPlanes natural = natural_rods_of(model, sample);
    float apart = 0.0f;
    for (uint32_t i = 0; i < count; ++i)
      for (uint32_t v = model.pinned_root_count + 1; v < model.vertex_count; ++v)
        apart += glm::distance(glm::vec3(model.rod_edge[size_t{v} * model.strand_count + strand_of(i)]),
                               glm::vec3(natural.edge[size_t{v} * count + i]));
    if (apart < least) best = sample.weight_mps2;
    least = std::min(apart, least);
  }
  return best;
}

/// How stiff strands are; then directions of clamps and joints beside those of rods that carry a weight.
void write_rods(StepModel model, RodsTold told, const glm::dvec3& gravity_mps2,
                std::vector<std::byte>& bytes) {
  ByteWriter to(bytes);
  const size_t stride = model.strand_count;
  const glm::vec4* const bend = model.rod_strand.data() + 2 * stride;
  const glm::vec4* const twist = model.rod_strand.data() + 3 * stride;
  const float twist_over_bend = told.strand_count > 0 && bend->w > 0.0f ? twist->w / bend->w : 0.0f;
  to.put(twist_over_bend);
  told.twist_over_bend = static_cast<double>(twist_over_bend);
  ValueWriter writer;
  NumberTables stiffness;
  int32_t before = 0;
  for (uint32_t s = 0; s < told.strand_count; ++s) {
    const int32_t bits = first_bits(bend[s].w);
    stiffness.put(bits - before, writer);
    before = bits;
    told.bend_m4ps2.push_back(of_first_bits(bits));
  }
  told.weight_mps2 = carried_weight(model, told, gravity_mps2);
  put_vector(told.weight_mps2, to);
  const RodPlanes natural = natural_rods_of(model, told);
  std::array<NumberTables, 3> tables;
  code_rods(model, told.strand_count, natural, [&](float& value, float expected, int axis) {
    const float steps = (std::clamp(value, -1.0f, 1.0f) - expected) / kDirectionStep;
    tables[static_cast<size_t>(axis)].put(static_cast<int32_t>(std::lrint(steps)), writer);
  });
  writer.finish(bytes);
}

Status read_rods(ByteReader& bytes, std::span<const glm::vec3> rest_in_head_m, StepModel& model) {
  Numbers from{bytes};
  RodsTold told{rest_in_head_m, model.strand_count, model.has_tail};
  const auto twist_over_bend = from.take<float>(static_cast<double>(kMostStiffness));
  told.weight_mps2 = from.vector<float, glm::vec3>(kMaxGravityMps2);
  from.are_usable &= twist_over_bend >= 0.0f;
  RETURN_IF_ERROR(from.status("the rods"));
  told.twist_over_bend = static_cast<double>(twist_over_bend);
  ValueReader reader;
  ASSIGN_OR_RETURN(const auto rest, reader.open(bytes.rest()));
  bytes.take_bytes(bytes.rest().size() - rest.size());
  NumberTables stiffness;
  int32_t before = 0;
  for (uint32_t s = 0; s < model.strand_count; ++s) {
    before = wrapping_sum(before, stiffness.take(reader));
    told.bend_m4ps2.push_back(of_first_bits(before));
  }
  RodPlanes natural = natural_rods_of(model, told);
  model.rod_edge = natural.edge;
  model.rod_strand = natural.strand;
  std::array<NumberTables, 3> tables;
  code_rods(model, model.strand_count, natural, [&](float& value, float expected, int axis) {
    const auto steps = static_cast<float>(tables[static_cast<size_t>(axis)].take(reader));
    value = std::clamp(expected + kDirectionStep * steps, -1.0f, 1.0f);
  });
  for (uint32_t s = 0; s < model.strand_count; ++s) {
    const float bend = told.bend_m4ps2[s];
    model.rod_strand[size_t{2} * model.strand_count + s].w = bend;
    model.rod_strand[size_t{3} * model.strand_count + s].w = bend * twist_over_bend;
  }
  if (!reader.is_spent())
    return make_error(ErrorCode::BadInput, "the rods of a step do not end where they should");
  return {};
}

// In their order on the wire.
template <class Parameters, class Visit>
void visit_parameters(Parameters& p, Visit visit) {
  for (auto* value :
       {&p.s_damping, &p.air_drag_per_s, &p.style_stiffness_per_s2, &p.style_tip_share, &p.sag_free,
        &p.collider_friction, &p.max_speed_mps, &p.thrust_share, &p.thickness_spread})
    visit(*value);
}

Result<ModelConstants> read_constants(ByteReader& bytes) {
  ModelConstants constants;
  const auto count = bytes.take<uint8_t>();
  if (count > kMostConstants)
    return make_error(ErrorCode::LimitExceeded, "a step's kernel has {} constants, most are {}", count,
                      kMostConstants);
  for (size_t i = 0; i < count; ++i) {
    const auto length = bytes.take<uint8_t>();
    const auto text = bytes.take_bytes(std::min<size_t>(length, kMostNameBytes));
    const std::string name(reinterpret_cast<const char*>(text.data()), text.size());
    if (bytes.take<uint8_t>() == 0) {
      const auto value = bytes.take<double>();
      if (!(std::abs(value) <= kLargest))
        return make_error(ErrorCode::BadInput, "a step's constant is no number");
      constants[name] = value;
      continue;
    }
    const auto value = bytes.take<uint32_t>();
    if (value > kMostRounds && name.find("seed") == std::string::npos)
      return make_error(ErrorCode::LimitExceeded, "a step's count is {}, most are {}", value, kMostRounds);
    constants[name] = value;
  }
  return constants;
}

/// A pose near another one, in 28 bytes.
void put_near(const Pose& pose, const Pose& near, ByteWriter& to) {
  put_vector(glm::vec3(pose.position_m - near.position_m), to);
  const glm::quat rotation(pose.rotation);
  to.put(rotation.w);
  to.put(rotation.x);
  to.put(rotation.y);
  to.put(rotation.z);
}
Pose take_near(const Pose& near, Numbers& from) {
  const auto moved = from.vector<float, glm::vec3>(kMaxHeadPositionM);
  const auto w = from.take<float>(2.0);
  const auto axis = from.vector<float, glm::vec3>(2.0);
  return {near.position_m + glm::dvec3(moved), limited_rotation(glm::dquat(w, axis.x, axis.y, axis.z))};
}

void write_volume(const VolumeDesc& volume, ByteWriter& to) {
  for (const double value : {volume.friction_per_s, volume.repulsion_per_s2, volume.target_per_s2,
                             volume.wind_width_m, volume.rest_density_scale})
    to.put(value);
  to.put(static_cast<uint8_t>(volume.resolution));
  to.put(static_cast<uint8_t>(volume.smoothing));
  const AirDesc& air = volume.air;
  to.put(static_cast<uint8_t>((volume.is_implicit() ? kImplicit : 0) | (air.acts ? kAir : 0) |
                              (air.acts && air.has_wind ? kAirWind : 0)));
  if (!air.acts) return;
  for (const double value : {air.hairs, air.lock_width_m, air.hair_radius_m, air.hair_density_kgpm3})
    to.put(value);
}
Result<VolumeDesc> read_volume(ByteReader& bytes) {
  Numbers from{bytes};
  VolumeDesc volume;
  for (double* value : {&volume.friction_per_s, &volume.repulsion_per_s2, &volume.target_per_s2})
    from.are_usable &= (*value = from.take<double>(kMostVolumeRate)) >= 0.0;
  from.are_usable &= (volume.wind_width_m = from.take<double>(kMostWindWidthM)) >= 0.0;
  from.are_usable &= (volume.rest_density_scale = from.take<double>(kMostDensityScale)) > 0.0;
  volume.resolution = bytes.take<uint8_t>();
  volume.smoothing = bytes.take<uint8_t>();
  const auto flags = bytes.take<uint8_t>();
  volume.integration = (flags & kImplicit) != 0 ? "implicit" : "explicit";
  AirDesc& air = volume.air;
  air.acts = (flags & kAir) != 0;
  if (air.acts) air.has_wind = (flags & kAirWind) != 0;
  if (air.acts)
    for (auto [value, most] :
         {std::pair{&air.hairs, kMostHairs}, std::pair{&air.lock_width_m, kMostWindWidthM},
          std::pair{&air.hair_radius_m, kMostHairRadiusM},
          std::pair{&air.hair_density_kgpm3, kMostHairDensityKgpm3}})
      from.are_usable &= (*value = from.take<double>(most)) > 0.0;
  RETURN_IF_ERROR(from.status("the volume"));
  if (volume.resolution < kMinVolumeResolution || volume.resolution > kMostToldResolution ||
      volume.smoothing > kMaxVolumeSmoothing || !volume.acts())
    return make_error(ErrorCode::LimitExceeded,
                      "a step's volume has {} cells and {} smoothings, or does nothing", volume.resolution,
                      volume.smoothing);
  return volume;
}

template <class Code>
void code_field(ToldField& field, Code code) {
  const glm::uvec3 count = field.grid.node_count;
  glm::uvec3 node;
  size_t i = 0;
  for (node.z = 0; node.z < count.z; ++node.z)
    for (node.y = 0; node.y < count.y; ++node.y)
      for (node.x = 0; node.x < count.x; ++node.x) code(field.distance[i++], node);
}

void write_field(const ToldField& told, std::vector<std::byte>& bytes) {
  ByteWriter to(bytes);
  put_vector(told.grid.origin_m, to);
  to.put(told.grid.cell_m);
  for (int axis = 0; axis < 3; ++axis) to.put(static_cast<uint16_t>(told.grid.node_count[axis]));
  ToldField field = told;
  const int16_t most = *std::max_element(field.distance.begin(), field.distance.end());
  to.put(most);
  const GradedDistance graded(field.grid.cell_m, most);
  ValueWriter writer;
  std::array<NumberTables, 3> tables;
  code_field(field, [&](int16_t& value, const glm::uvec3& node) {
    const int32_t guess = graded.within(curved_guess(field.distance, field.grid.node_count, node));
    const int32_t level = graded.level_of(value);
    tables[graded.table_of(guess)].put(level - graded.level_of(guess), writer);
    value = graded.distance_of(level);
  });
  writer.finish(bytes);
}

Result<std::shared_ptr<const ToldField>> read_field(ByteReader& bytes, uint8_t kind) {
  Numbers from{bytes};
  auto field = std::make_shared<ToldField>();
  field->grid.origin_m = from.vector<float, glm::vec3>(kMaxColliderM);
  field->grid.cell_m = from.take<float>(kMostCellM);
  for (int axis = 0; axis < 3; ++axis) field->grid.node_count[axis] = bytes.take<uint16_t>();
  RETURN_IF_ERROR(from.status("the field"));
  const glm::uvec3& count = field->grid.node_count;
  if (!(field->grid.cell_m > 0.0f) || count.x < 2 || count.y < 2 || count.z < 2 ||
      field->grid.size() > kMostToldNodes)
    return make_error(ErrorCode::LimitExceeded, "a step's field has {} x {} x {} nodes, at most {} are",
                      count.x, count.y, count.z, kMostToldNodes);
  const GradedDistance graded(field->grid.cell_m, kind == kField ? int16_t{0} : bytes.take<int16_t>());
  ValueReader reader;
  ASSIGN_OR_RETURN(const auto rest, reader.open(bytes.rest()));
  bytes.take_bytes(bytes.rest().size() - rest.size());
  field->distance.resize(field->grid.size());
  std::array<NumberTables, 3> tables;
  code_field(*field, [&](int16_t& value, const glm::uvec3& node) {
    if (kind == kField) {  // of number 12
      const int32_t guess = linear_guess(field->distance, count, node);
      value = static_cast<int16_t>(wrapping_sum(guess, tables[0].take(reader)));
      return;
    }
    const int32_t guess = graded.within(curved_guess(field->distance, count, node));
    const int32_t beside = tables[graded.table_of(guess)].take(reader);
    value = graded.distance_of(wrapping_sum(graded.level_of(guess), beside));
  });
  if (!reader.is_spent())
    return make_error(ErrorCode::BadInput, "the field of a step does not end where it should");
  return std::shared_ptr<const ToldField>(std::move(field));
}

void write_passes(const StepModel& model, std::vector<std::byte>& bytes) {
  ByteWriter to(bytes);
  uint8_t flags = model.bend ? kBend : 0;
  if (model.drag_along_share != 1.0) flags |= kDrag;
  if (model.meets_body) flags |= kMeetsBody;
  if (model.field != nullptr) flags |= kGradedField;
  to.put(flags);
  if (model.bend)
    for (const double angle : {model.bend->least_root_rad, model.bend->least_tip_rad,
                               model.bend->most_root_rad, model.bend->most_tip_rad})
      to.put(angle);
  if ((flags & kDrag) != 0) to.put(model.drag_along_share);
  if (model.field != nullptr) write_field(*model.field, bytes);
}

Status read_passes(ByteReader& bytes, StepModel& model) {
  Numbers from{bytes};
  const auto flags = bytes.take<uint8_t>();
  constexpr uint8_t kFields = kField | kGradedField;
  if (flags > (kBend | kDrag | kMeetsBody | kFields) || (flags & kFields) == kFields)
    return make_error(ErrorCode::Unsupported, "a step does {:#x} besides, which this build does not know",
                      flags);
  if ((flags & kBend) != 0) {
    BendAngles& bend = model.bend.emplace();
    for (double* angle : {&bend.least_root_rad, &bend.least_tip_rad, &bend.most_root_rad, &bend.most_tip_rad})
      *angle = from.take<double>(std::numbers::pi);
  }
  if ((flags & kDrag) != 0) model.drag_along_share = from.take<double>(1.0);
  model.meets_body = (flags & kMeetsBody) != 0;
  RETURN_IF_ERROR(from.status("what a step does besides"));
  if ((flags & kFields) != 0) {
    ASSIGN_OR_RETURN(model.field, read_field(bytes, flags & kFields));
  }
  return {};
}

void write_body(const BodyInput& body, ByteWriter& to) {
  to.put(static_cast<uint8_t>(body.capsules.size()));
  for (const BodyCapsule& capsule : body.capsules) {
    to.put(static_cast<float>(capsule.from_radius_m));
    to.put(static_cast<float>(capsule.to_radius_m));
  }
  to.put(static_cast<uint8_t>(body.planes.size()));
  for (const BodyPlane& plane : body.planes)
    for (const glm::dvec3& vector : {plane.point_m, plane.normal, plane.shift_m}) put_vector(vector, to);
  to.put(static_cast<uint8_t>(body.response));
  for (const double value : {body.friction, body.tip_clearance_m, body.force_per_s2}) to.put(value);
}

Result<BodyInput> read_body(ByteReader& bytes) {
  Numbers from{bytes};
  BodyInput body;
  const auto capsule_count = bytes.take<uint8_t>();
  if (capsule_count > kMaxBodyCapsules)
    return make_error(ErrorCode::LimitExceeded, "a step's body has {} capsules, most are {}", capsule_count,
                      kMaxBodyCapsules);
  body.capsules.resize(capsule_count);
  for (BodyCapsule& capsule : body.capsules) {
    capsule.from_radius_m = from.take<float>(kMaxColliderM);
    capsule.to_radius_m = from.take<float>(kMaxColliderM);
  }
  const auto plane_count = bytes.take<uint8_t>();
  if (plane_count > kMaxBodyPlanes)
    return make_error(ErrorCode::LimitExceeded, "a step's body has {} planes, most are {}", plane_count,
                      kMaxBodyPlanes);
  body.planes.resize(plane_count);
  for (BodyPlane& plane : body.planes) {
    plane.point_m = from.vector<double, glm::dvec3>(kMaxColliderM);
    plane.normal = from.vector<double, glm::dvec3>(kMostNormal);
    plane.shift_m = from.vector<double, glm::dvec3>(kMaxColliderM);
  }
  const auto response = bytes.take<uint8_t>();
  if (response >= kBodyResponses.size())
    return make_error(ErrorCode::BadInput, "strands of a step answer to a body in way {}", response);
  body.response = static_cast<BodyResponse>(response);
  body.friction = from.take<double>(kLargest);
  body.tip_clearance_m = from.take<double>(kMaxColliderM);
  body.force_per_s2 = from.take<double>(kMostForcePerS2);
  RETURN_IF_ERROR(from.status("the body"));
  return body;
}

PointSteps point_steps(const glm::dvec3& point_m) {
  PointSteps steps;
  for (int axis = 0; axis < 3; ++axis)
    steps[static_cast<size_t>(axis)] =
        static_cast<int32_t>(std::lrint(limited(point_m[axis], kMaxColliderM) / kBodyStepM));
  return steps;
}
glm::dvec3 point_of(const PointSteps& steps) {
  return kBodyStepM * glm::dvec3(steps[0], steps[1], steps[2]);
}

/// Writes or reads the angles of a chest, each beside that of the tick before.
void put_chest(BustCode chest, BustCode before, ByteWriter& to) {
  for (const uint32_t bits : kChestBits) {
    const uint32_t mask = (1u << bits) - 1;
    to.put_varint(fold_sign(static_cast<int32_t>(chest & mask) - static_cast<int32_t>(before & mask)));
    chest >>= bits;
    before >>= bits;
  }
}
BustCode take_chest(BustCode before, ByteReader& from) {
  BustCode chest = 0;
  uint32_t shift = 0;
  for (const uint32_t bits : kChestBits) {
    const auto beside = static_cast<uint32_t>(unfold_sign(from.take_varint<uint32_t>()));
    chest |= (((before >> shift) + beside) & ((1u << bits) - 1)) << shift;
    shift += bits;
  }
  return chest;
}

/// Whether a tick can say where the scene's body is.
bool tells_body(const StepTick& tick, const StepScene& scene) {
  return tick.has_body && tick.body_m.size() == 2 * scene.body.capsules.size();
}

}  // namespace

void write_model(const StepModel& model, std::span<const glm::vec3> rest_in_head_m, uint32_t strand_count,
                 std::vector<std::byte>& bytes, const glm::dvec3& gravity_mps2) {
  ByteWriter to(bytes);
  const StepKernel* kernel = find_step_kernel(model.kernel.shader_path);
  const int extras = (tells_volume(model) ? kVolume : 0) | (model.has_passes() ? kPasses : 0);
  to.put(static_cast<uint8_t>(kernel->number | extras | (model.has_tail.empty() ? 0 : kMixedTips)));
  to.put(static_cast<uint8_t>(model.kernel.variant_of("HAS_TWIST")));
  to.put(static_cast<uint8_t>(model.pinned_root_count));
  to.put(static_cast<uint8_t>(model.pinned_tail_count));
  if (!model.has_tail.empty()) write_tails(std::span(model.has_tail).first(strand_count), to);
  visit_parameters(model.parameters, [&](const double& value) { to.put(value); });
  to.put(static_cast<uint8_t>(model.kernel.constants.size()));
  for (const auto& [name, value] : model.kernel.constants) {
    to.put(static_cast<uint8_t>(name.size()));
    to.put_bytes(std::as_bytes(std::span(name)));
    to.put(static_cast<uint8_t>(value.index()));
    std::visit([&](auto number) { to.put(number); }, value);
  }
  if (tells_volume(model)) write_volume(model.volume, to);
  if (model.has_passes()) write_passes(model, bytes);
  if (!kernel->fixed.empty())
    write_rods(model, {rest_in_head_m, strand_count, model.has_tail}, gravity_mps2, bytes);
}

Result<StepModel> read_model(ByteReader& bytes, std::span<const glm::vec3> rest_in_head_m,
                             uint32_t strand_count, uint32_t vertex_count) {
  Numbers from{bytes};
  if (rest_in_head_m.size() != size_t{strand_count} * vertex_count)
    return make_error(ErrorCode::Unsupported, "strands without a rest shape cannot be predicted by a step");
  StepModel model;
  const auto first = bytes.take<uint8_t>();
  const auto number = static_cast<uint8_t>(first & ~(kVolume | kPasses | kMixedTips));
  const StepKernel* kernel = find_step_kernel(number);
  if (kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "a step of kernel {}, which this build does not know", number);
  const bool has_twist = bytes.take<uint8_t>() != 0 && kernel->has_twist_variant;
  model.strand_count = strand_count;
  model.vertex_count = vertex_count;
  model.pinned_root_count = bytes.take<uint8_t>();
  model.pinned_tail_count = bytes.take<uint8_t>();
  const bool is_mixed = (first & kMixedTips) != 0;
  if (model.pinned_root_count < 1 || model.pinned_root_count + model.pinned_tail_count > vertex_count ||
      (is_mixed && model.pinned_tail_count == 0))
    return make_error(ErrorCode::BadInput, "a step pins {} and {} of {} vertices", model.pinned_root_count,
                      model.pinned_tail_count, vertex_count);
  ASSIGN_OR_RETURN(model.has_tail, read_tails(bytes, is_mixed ? strand_count : 0));
  visit_parameters(model.parameters, [&](double& value) { value = from.take<double>(kLargest); });
  ASSIGN_OR_RETURN(model.kernel.constants, read_constants(bytes));
  model.kernel.shader_path = kernel->shader_path;
  model.kernel.variant = {{"HAS_PINNED_TAIL", model.pinned_tail_count > 0 ? 1 : 0}};
  if (kernel->has_twist_variant) model.kernel.variant["HAS_TWIST"] = has_twist ? 1 : 0;
  model.kernel.scratch_rows = kernel->scratch_rows[has_twist ? 1 : 0];
  RETURN_IF_ERROR(from.status("the model"));
  if ((first & kVolume) != 0) {
    ASSIGN_OR_RETURN(model.volume, read_volume(bytes));
  }
  if ((first & kPasses) != 0) RETURN_IF_ERROR(read_passes(bytes, model));
  if (!kernel->fixed.empty()) RETURN_IF_ERROR(read_rods(bytes, rest_in_head_m, model));
  return model;
}

// What a volume takes, in rounds of a vertex.
constexpr uint64_t kRoundsPerSample = 8;
constexpr uint64_t kRoundsPerCell = 2;
// And what else acts on strands.
constexpr uint64_t kRoundsOfPass = 2;
constexpr uint64_t kRoundsOfField = 8;
constexpr uint64_t kRoundsOfShape = 2;

uint64_t vertex_rounds(const StepModel& model, const StepScene& scene, size_t tick_count) {
  uint64_t rounds = 1;
  for (const auto& [name, value] : model.kernel.constants)
    if (const auto* count = std::get_if<uint32_t>(&value); count != nullptr && *count <= kMostRounds)
      rounds += *count;
  const uint64_t vertices = uint64_t{model.strand_count} * model.vertex_count;
  uint64_t of_volume = 0;
  if (tells_volume(model)) {
    const uint64_t cells =
        uint64_t{model.volume.resolution} * model.volume.resolution * model.volume.resolution;
    of_volume = kRoundsPerSample * vertices + kRoundsPerCell * cells + 2 * scene.substeps * vertices;
  }
  if (model.bend) rounds += kRoundsOfPass;
  if (model.drag_along_share != 1.0) rounds += kRoundsOfPass;
  if (model.field != nullptr) rounds += kRoundsOfField;
  if (model.meets_body)
    rounds += kRoundsOfPass + kRoundsOfShape * (scene.body.capsules.size() + scene.body.planes.size());
  return tick_count * (rounds * scene.substeps * vertices + of_volume);
}

void write_scene(const StepScene& scene, std::vector<std::byte>& bytes) {
  ByteWriter to(bytes);
  to.put(scene.step_s);
  to.put(static_cast<uint8_t>(scene.substeps | (scene.body.acts() ? kSceneBody : 0)));
  put_vector(scene.gravity_mps2, to);
  put_vector(scene.groom_gravity_in_head_mps2, to);
  to.put(scene.follicle_limit_rad);
  to.put(scene.follicle_cosine);
  to.put(scene.follicle_sine);
  to.put(static_cast<uint8_t>(scene.colliders.size() | (scene.bust.exists() ? kSceneBust : 0)));
  for (const SphereCollider& sphere : scene.colliders) {
    put_vector(sphere.center_m, to);
    to.put(sphere.radius_m);
  }
  if (scene.bust.exists()) {
    put_vector(scene.bust.pivot_m, to);
    put_vector(scene.bust.share, to);
    to.put(scene.bust.share.w);
  }
  put_vector(scene.mean_wind_mps, to);
  to.put(static_cast<uint8_t>(scene.waves.size()));
  for (const GustWave& wave : scene.waves) {
    put_vector(wave.amplitude_mps, to);
    put_vector(wave.wave_vector_rad_per_m, to);
    to.put(wave.phase_rad);
  }
  if (scene.body.acts()) write_body(scene.body, to);
}

Result<StepScene> read_scene(ByteReader& bytes) {
  Numbers from{bytes};
  StepScene scene;
  scene.step_s = from.take<double>(kMaxSubstepS * kMaxSubsteps);
  const auto substeps = bytes.take<uint8_t>();
  scene.substeps = static_cast<uint8_t>(substeps & ~kSceneBody);
  if (scene.substeps < 1 || scene.substeps > kMaxSubsteps)
    return make_error(ErrorCode::LimitExceeded, "a step of {} substeps, not 1..{}", scene.substeps,
                      kMaxSubsteps);
  scene.gravity_mps2 = from.vector<double, glm::dvec3>(kMaxGravityMps2);
  scene.groom_gravity_in_head_mps2 = from.vector<double, glm::dvec3>(kMaxGravityMps2);
  scene.follicle_limit_rad = from.take<double>(kFreeFollicleRad);
  scene.follicle_cosine = from.take<float>(1.0);
  scene.follicle_sine = from.take<float>(1.0);
  const auto colliders = bytes.take<uint8_t>();
  const auto collider_count = static_cast<uint8_t>(colliders & ~kSceneBust);
  if (collider_count > kMaxSphereColliders)
    return make_error(ErrorCode::LimitExceeded, "a step has {} colliders, most are {}", collider_count,
                      kMaxSphereColliders);
  for (size_t i = 0; i < collider_count; ++i) {
    const auto center_m = from.vector<float, glm::vec3>(kMaxColliderM);
    scene.colliders.push_back({center_m, from.take<float>(kMaxColliderM)});
  }
  if ((colliders & kSceneBust) != 0) {
    scene.bust.pivot_m = from.vector<float, glm::vec3>(kMaxColliderM);
    const auto share = from.vector<float, glm::vec3>(kMostBustShare);
    scene.bust.share = glm::vec4(share, from.take<float>(kMostBustShare));
  }
  scene.mean_wind_mps = from.vector<double, glm::dvec3>(kMaxWindMps);
  const auto wave_count = bytes.take<uint8_t>();
  if (wave_count > kMaxGustWaves)
    return make_error(ErrorCode::LimitExceeded, "a step has {} waves of wind, most are {}", wave_count,
                      kMaxGustWaves);
  for (size_t i = 0; i < wave_count; ++i) {
    GustWave wave;
    wave.amplitude_mps = from.vector<float, glm::vec3>(kMaxWindMps);
    wave.wave_vector_rad_per_m = from.vector<float, glm::vec3>(kMaxPhaseRad);
    wave.phase_rad = from.take<float>(kMaxPhaseRad);
    scene.waves.push_back(wave);
  }
  RETURN_IF_ERROR(from.status("the scene"));
  if ((substeps & kSceneBody) != 0) {
    ASSIGN_OR_RETURN(scene.body, read_body(bytes));
  }
  return scene;
}

WindSteps wind_steps(const glm::dvec3& wind_mps) {
  WindSteps steps;
  for (int axis = 0; axis < 3; ++axis)
    steps[static_cast<size_t>(axis)] =
        static_cast<int32_t>(std::lrint(limited(wind_mps[axis], kMaxWindMps) / kWindStepMps));
  return steps;
}

glm::dvec3 wind_of(const WindSteps& steps) {
  return kWindStepMps * glm::dvec3(steps[0], steps[1], steps[2]);
}

void write_ticks(std::span<const StepTick> ticks, const StepScene& scene, TickBase& base,
                 std::vector<std::byte>& bytes) {
  ByteWriter to(bytes);
  to.put(static_cast<uint8_t>(ticks.size()));
  const auto put_beside = [&](const PointSteps& now, const PointSteps& before) {
    for (size_t axis = 0; axis < 3; ++axis) to.put_varint(fold_sign(now[axis] - before[axis]));
  };
  for (const StepTick& tick : ticks) {
    const Pose& last = ticks.back().world_from_head;
    uint8_t flags = tick.has_waves ? kWaves : 0;
    if (tick.carried_to) flags |= kCarried;
    if (tick.carried_to && *tick.carried_to != tick.world_from_head) flags |= kCarriedElsewhere;
    if (tells_body(tick, scene)) flags |= kTickBody;
    if (tick.is_body_new) flags |= kTickNewBody;
    if (scene.bust.exists() && tick.bust != kRigidBust) flags |= kTickBust;
    const WindSteps now = wind_steps(tick.wind_mps);
    if (now == base.wind) flags |= kSteadyWind;
    to.put(flags);
    if (now != base.wind) put_beside(now, base.wind);
    base.wind = now;
    if ((flags & kTickBody) != 0) {
      base.body.resize(tick.body_m.size());  // new ones count from 0
      for (size_t i = 0; i < base.body.size(); ++i) {
        const PointSteps point = point_steps(tick.body_m[i]);
        put_beside(point, base.body[i]);
        base.body[i] = point;
      }
    } else {
      base.body.clear();
    }
    if ((flags & kTickBust) != 0) put_chest(tick.bust, base.chest, to);
    base.chest = (flags & kTickBust) != 0 ? tick.bust : kRigidBust;
    if (&tick != &ticks.back()) put_near(tick.world_from_head, last, to);
    if ((flags & kCarriedElsewhere) != 0) put_near(*tick.carried_to, last, to);
  }
}

Result<std::vector<StepTick>> read_ticks(ByteReader& bytes, const FrameTick& last, const StepScene& scene,
                                         TickBase& base) {
  Numbers from{bytes};
  const auto count = bytes.take<uint8_t>();
  if (count > kMostTrailTicks)
    return make_error(ErrorCode::LimitExceeded, "a frame of {} steps, most are {}", count, kMostTrailTicks);
  const auto take_beside = [&](PointSteps& steps, int32_t most) {
    for (int32_t& value : steps)
      value = std::clamp(wrapping_sum(value, unfold_sign(bytes.take_varint<uint32_t>())), -most, most);
  };
  std::vector<StepTick> ticks(count);
  for (size_t i = 0; i < count; ++i) {
    StepTick& tick = ticks[i];
    tick.tick = last.tick - (count - 1 - i);
    const auto flags = bytes.take<uint8_t>();
    if (flags > kTickFlags) return make_error(ErrorCode::BadInput, "a step has flags {}", flags);
    tick.has_waves = (flags & kWaves) != 0;
    tick.has_body = (flags & kTickBody) != 0;
    tick.is_body_new = (flags & kTickNewBody) != 0;
    if ((flags & kSteadyWind) == 0) take_beside(base.wind, kMostWindSteps);
    tick.wind_mps = wind_of(base.wind);
    if (tick.has_body) {
      const size_t points = 2 * scene.body.capsules.size();
      if (base.body.size() == points && !tick.is_body_new)
        for (const PointSteps& point : base.body) tick.body_before_m.push_back(point_of(point));
      base.body.resize(points);
      for (PointSteps& point : base.body) {
        take_beside(point, kMostBodySteps);
        tick.body_m.push_back(point_of(point));
      }
    } else {
      base.body.clear();
    }
    if ((flags & kTickBust) != 0) tick.bust = take_chest(base.chest, bytes);
    base.chest = tick.bust;
    tick.world_from_head = i + 1 < count ? take_near(last.world_from_head, from) : last.world_from_head;
    if ((flags & kCarriedElsewhere) != 0)
      tick.carried_to = take_near(last.world_from_head, from);
    else if ((flags & kCarried) != 0)
      tick.carried_to = tick.world_from_head;
    // What was carried along takes its bust with it.
    if (!tick.carried_to) tick.bust_before = base.bust;
    base.bust = bust_turn(tick.bust, tick.world_from_head.rotation);
  }
  RETURN_IF_ERROR(from.status("a tick"));
  return ticks;
}

StepScene told_scene(const StepScene& scene, std::vector<std::byte>& bytes) {
  const size_t begin = bytes.size();
  write_scene(scene, bytes);
  ByteReader reader(std::span<const std::byte>(bytes).subspan(begin));
  Result<StepScene> read = read_scene(reader);
  CHECK(read.ok());
  return std::move(*read);
}

std::vector<StepTick> told_ticks(std::span<const StepTick> ticks, const FrameTick& last,
                                 const StepScene& scene, TickBase& base, std::vector<std::byte>& bytes) {
  const size_t begin = bytes.size();
  TickBase written = base;
  write_ticks(ticks, scene, written, bytes);
  ByteReader reader(std::span<const std::byte>(bytes).subspan(begin));
  Result<std::vector<StepTick>> read = read_ticks(reader, last, scene, base);
  CHECK(read.ok());
  return std::move(*read);
}

}  // namespace strandcast::step
