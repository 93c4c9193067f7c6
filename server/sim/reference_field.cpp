#include "server/sim/reference_field.h"

#include <algorithm>
#include <cmath>

#include "server/sim/reference_contact.h"

namespace strandcast {
namespace {

/// So much nearer than in the groom is no contact yet.
constexpr double kFieldSlackM = 1e-6;
constexpr double kLeastSlope = 0.5;
/// Rounds go on until the end is so near to its clearance, from either side.
constexpr double kFieldResidueM = 2e-6;

/// The nearest part of the skin as a plane that a point is in front of.
struct FieldContact {
  glm::dvec3 normal{0.0};
  double depth_m = 0.0;  // below the clearance; not positive = none
};

FieldContact contact_of(const DistanceField::Sample& sample, double clearance_m) {
  const double slope = glm::length(sample.gradient);
  return {slope > 0.0 ? sample.gradient / slope : glm::dvec3(0.0),
          (clearance_m - sample.distance_m) / std::max(slope, kLeastSlope)};
}

/// The segment of this length whose end stands so high over its start, leaning to where `towards` does.
glm::dvec3 segment_at_height(const glm::dvec3& towards, const glm::dvec3& normal, double length_m,
                             double height_m) {
  const double angle = std::asin(std::clamp(height_m / length_m, -1.0, 1.0));
  glm::dvec3 flat = towards - glm::dot(towards, normal) * normal;
  if (glm::length(flat) <= 1e-6 * length_m)
    flat = std::abs(normal.x) < 0.6 ? glm::dvec3(0.0, normal.z, -normal.y)
                                    : glm::dvec3(-normal.z, 0.0, normal.x);
  flat = glm::normalize(flat - glm::dot(flat, normal) * normal);
  return length_m * (std::sin(angle) * normal + std::cos(angle) * flat);
}

glm::dvec3 after_friction(const glm::dvec3& before_m, const glm::dvec3& end_m, const FieldContact& contact,
                          double friction) {
  const glm::dvec3 slip = end_m - before_m;
  const glm::dvec3 sliding = slip - glm::dot(slip, contact.normal) * contact.normal;
  const double way_m = glm::length(sliding);
  const double hold_m = friction * std::max(0.0, contact.depth_m);
  return way_m <= hold_m ? end_m - sliding : end_m - hold_m / way_m * sliding;
}

}  // namespace

double field_clearance_m(const DistanceField& field, const glm::dvec3& groomed_m) {
  return std::min(kFieldClearanceM, field.sample(groomed_m).distance_m - kFieldSlackM);
}

// The skin's place at rest lies as far from the field, and the way there is turned with it.
DistanceField::Sample sample_on_bust(const DistanceField& field, const BustInput& bust,
                                     const glm::dvec3& point_m) {
  const glm::dvec3 rest_m = without_bust(bust.rig, bust.turn, point_m);
  DistanceField::Sample found = field.sample(rest_m);
  found.gradient = turned_with_bust(bust.rig, bust.turn, rest_m, found.gradient);
  return found;
}

bool keep_out_of(const DistanceField& field, const ReferenceFieldStrand& strand) {
  const BustInput& bust = strand.bust;
  const auto sampled = [&](const glm::dvec3& point_m) { return sample_on_bust(field, bust, point_m); };
  const auto carried = [&](const glm::dvec3& before_m) {
    return with_bust(bust.rig, bust.turn, without_bust(bust.rig, bust.turn_before, before_m));
  };
  bool has_moved = false;
  glm::dvec3 start_before = strand.position_m[strand.first - 1];
  for (size_t i = strand.first; i < strand.position_m.size(); ++i) {
    const glm::dvec3 start = strand.position_m[i - 1];
    const glm::dvec3 place = strand.position_m[i];
    const double length_m = glm::distance(place, start_before);
    glm::dvec3 end = place;
    if (start != start_before) {
      const glm::dvec3 along = place - start;
      end = start +
            (glm::length(along) > kTinyLengthM ? length_m * glm::normalize(along) : place - start_before);
    }
    if (length_m > kTinyLengthM) {
      const double clearance_m = field_clearance_m(field, strand.groomed_m[i]);
      const double middle_clearance_m =
          field_clearance_m(field, 0.5 * (strand.groomed_m[i - 1] + strand.groomed_m[i]));
      for (int attempt = 0; attempt < 2; ++attempt) {
        for (int round = 0; round < kMostRounds; ++round) {
          const DistanceField::Sample found = sampled(end);
          const FieldContact contact = contact_of(found, clearance_m);
          const double short_m = clearance_m - found.distance_m;
          if (!(round == 0 ? short_m > 0.0 : std::abs(short_m) > kFieldResidueM)) break;
          const glm::dvec3 held = after_friction(carried(strand.before_m[i]), end, contact, strand.friction);
          end = start + segment_at_height(held - start, contact.normal, length_m,
                                          glm::dot(end - start, contact.normal) + contact.depth_m);
        }
        const glm::dvec3 middle = 0.5 * (start + end);
        const FieldContact cut = contact_of(sampled(middle), middle_clearance_m);
        if (!(cut.depth_m > 0.0)) break;
        const glm::dvec3 middle_before = carried(0.5 * (strand.before_m[i - 1] + strand.before_m[i]));
        const glm::dvec3 held = after_friction(middle_before, middle, cut, strand.friction);
        end = start + segment_at_height(held - start, cut.normal, length_m,
                                        glm::dot(end - start, cut.normal) + 2.0 * cut.depth_m);
        if (!(cut.depth_m > kLookAgainM)) break;
      }
    }
    has_moved = has_moved || end != place;
    start_before = place;
    strand.position_m[i] = end;
  }
  return has_moved;
}

}  // namespace strandcast
