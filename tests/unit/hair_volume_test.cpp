// The hair volume keeps length and momentum, is what plain loops in double say, and is the same bits from
// every instruction set and number of threads.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "common/kernels/volume/volume_extras.h"
#include "server/sim/strand_layout.h"
#include "server/sim/volume/reference_volume.h"
#include "tests/support/own_workers.h"

namespace strandcast::hair_volume_test {
namespace {

using testing::HasSubstr;

/// Strands of random steps from roots on a sphere, and what they are doing.
struct Hair {
  StrandLayout layout;
  std::vector<glm::vec3> position_m;  // (vertex_count x strand_count) head-relative world axes
  std::vector<glm::vec3> velocity_mps;
  glm::dquat world_from_head{1.0, 0.0, 0.0, 0.0};
  glm::vec3 head_velocity_mps{0.0f};
  float ahead_s = 0.0f;
  StrandBlocks position_blocks;
  StrandBlocks velocity_blocks;

  VolumeInput input() {
    position_blocks = StrandBlocks(layout.strand_count, layout.vertex_count);
    velocity_blocks = StrandBlocks(layout.strand_count, layout.vertex_count);
    pack_blocks(position_m, position_blocks);
    pack_blocks(velocity_mps, velocity_blocks);
    VolumeInput input;
    input.position_m = position_blocks.view();
    input.velocity_mps = velocity_blocks.view();
    input.head_from_world = glm::mat3(glm::mat3_cast(glm::conjugate(world_from_head)));
    input.head_velocity_mps = head_velocity_mps;
    input.ahead_s = ahead_s;
    return input;
  }

  HairSample sample(size_t vertex) const {
    const glm::dvec3 velocity_mps_now = glm::dvec3(velocity_mps[vertex]) - glm::dvec3(head_velocity_mps);
    const glm::dvec3 at = glm::dvec3(position_m[vertex]) + static_cast<double>(ahead_s) * velocity_mps_now;
    return {glm::conjugate(world_from_head) * at, velocity_mps_now, 0.0};
  }
  /// Vertices with half of the segments beside them, or `samples` of each segment.
  std::vector<HairSample> samples(uint32_t of_segment) const {
    std::vector<HairSample> all;
    for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
      for (uint32_t vertex = 0; vertex < layout.vertex_count; ++vertex) {
        const size_t at = layout.index(vertex, strand);
        const auto before_m = vertex == 0 ? 0.0 : static_cast<double>(layout.rest[at].w);
        if (of_segment == 1) {
          const bool is_last = vertex + 1 == layout.vertex_count;
          const auto after_m = is_last ? 0.0 : static_cast<double>(layout.rest[at + layout.strand_count].w);
          all.push_back(sample(at));
          all.back().length_m = 0.5 * (before_m + after_m);
        } else if (vertex > 0) {
          const HairSample from = sample(at - layout.strand_count);
          const HairSample to = sample(at);
          for (uint32_t i = 0; i < of_segment; ++i) {
            const double share = (i + 0.5) / of_segment;
            all.push_back({glm::mix(from.in_head_m, to.in_head_m, share),
                           glm::mix(from.velocity_mps, to.velocity_mps, share), before_m / of_segment});
          }
        }
      }
    return all;
  }
};

Hair random_hair(uint32_t strand_count, uint32_t vertex_count, float step_m, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const auto vector = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  Groom groom;
  groom.offset = {0};
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    glm::vec3 point = 0.1f * glm::normalize(vector());
    const glm::vec3 along = point * (step_m / 0.1f);
    for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
      groom.rest_position_m.push_back(point);
      point += along + 0.3f * step_m * vector();
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  for (uint32_t strand = 0; strand < strand_count; ++strand) groom.pinned[groom.offset[strand]] = 1;
  Hair hair;
  hair.layout = *make_strand_layout(groom);
  hair.world_from_head = glm::normalize(glm::dquat(0.9, 0.3, -0.2, 0.1));
  hair.head_velocity_mps = {0.4f, -1.2f, 0.3f};
  hair.ahead_s = 1.0f / 60.0f;
  for (const glm::vec4& rest : hair.layout.rest) {
    const glm::dvec3 moved = hair.world_from_head * glm::dvec3(rest) + 0.002 * glm::dvec3(vector());
    hair.position_m.push_back(glm::vec3(moved));
    hair.velocity_mps.push_back(hair.head_velocity_mps + vector());
  }
  return hair;
}

VolumeStrands strands_of(const StrandLayout& layout) {
  return {layout.strand_count, layout.vertex_count, layout.rest, {}};
}

struct Filled {
  HairVolume volume;
  std::vector<glm::vec4> nodes;
};
Filled fill(Hair& hair, const VolumeOptions& options) {
  Result<HairVolume> volume = HairVolume::make(strands_of(hair.layout), options);
  EXPECT_TRUE(volume) << volume.error().to_string();
  Filled filled{std::move(*volume), {}};
  filled.nodes.assign(filled.volume.most_nodes(), glm::vec4(7.0f));
  filled.volume.update(hair.input(), filled.nodes);
  filled.nodes.resize(filled.volume.grid().size());
  return filled;
}

double sum_of_lengths(const Filled& filled) {
  const auto cell_m = static_cast<double>(filled.volume.cell_m());
  double sum = 0.0;
  for (const glm::vec4& node : filled.nodes) sum += static_cast<double>(node.w) * cell_m * cell_m * cell_m;
  return sum;
}

TEST(HairVolume, KeepsLength) {
  Hair hair = random_hair(333, 16, 0.008f, 1);
  for (const uint32_t smoothing : {0u, 1u, 3u}) {
    const Filled filled = fill(hair, {24, smoothing});
    EXPECT_EQ(filled.volume.outside_count(), 0u);
    EXPECT_NEAR(sum_of_lengths(filled) / filled.volume.length_m(), 1.0, 1e-6) << smoothing;
  }
}

// What friction takes out by interpolating is what the sums put in: hair with these velocities has the
// momentum of the hair, however often the volume was smoothed.
TEST(HairVolume, GivesBackMomentum) {
  Hair hair = random_hair(500, 16, 0.004f, 2);
  for (const uint32_t smoothing : {0u, 1u, 2u}) {
    const Filled filled = fill(hair, {24, smoothing});
    ASSERT_EQ(filled.volume.sample_count(), hair.layout.size());  // vertices are the samples
    glm::dvec3 momentum(0.0);
    glm::dvec3 given_back(0.0);
    double size = 0.0;
    for (const HairSample& sample : hair.samples(1)) {
      const VolumeSample found = sample_volume(filled.volume.grid(), filled.nodes, sample.in_head_m);
      ASSERT_TRUE(found.is_inside);
      momentum += sample.length_m * sample.velocity_mps;
      given_back += sample.length_m * found.velocity_mps;
      size += sample.length_m * glm::length(sample.velocity_mps);
    }
    EXPECT_LT(glm::distance(momentum, given_back) / size, 1e-6) << smoothing;
  }
}

TEST(HairVolume, KeepsAConstantVelocity) {
  Hair hair = random_hair(200, 16, 0.006f, 3);
  const glm::vec3 velocity(0.5f, -2.0f, 1.0f);
  for (glm::vec3& v : hair.velocity_mps) v = hair.head_velocity_mps + velocity;
  for (const uint32_t smoothing : {0u, 1u}) {
    const Filled filled = fill(hair, {24, smoothing});
    for (const HairSample& sample : hair.samples(1)) {
      const VolumeSample found = sample_volume(filled.volume.grid(), filled.nodes, sample.in_head_m);
      // Where smoothing reached nodes without hair of their own, all around are some with it.
      ASSERT_LT(glm::distance(found.velocity_mps, glm::dvec3(velocity)), 3e-6 * glm::length(velocity));
    }
  }
}

TEST(HairVolume, IsWhatPlainLoopsInDoubleSay) {
  for (const auto& [step_m, resolution] : {std::pair{0.006f, 20u}, {0.012f, 48u}}) {
    Hair hair = random_hair(700, 16, step_m, 4);
    for (const uint32_t smoothing : {0u, 1u, 2u}) {
      const Filled filled = fill(hair, {resolution, smoothing});
      const auto of_segment =
          static_cast<uint32_t>(filled.volume.sample_count() / (size_t{hair.layout.strand_count} * 15));
      const std::vector<HairSample> samples = hair.samples(std::max(of_segment, 1u));
      ASSERT_EQ(samples.size(), filled.volume.sample_count());
      const ReferenceVolume reference = make_reference_volume(filled.volume.grid(), samples, smoothing);
      double density_error = 0.0;
      double density = 0.0;
      double velocity_error = 0.0;
      double velocity = 0.0;
      for (size_t i = 0; i < reference.nodes.size(); ++i) {
        const glm::dvec4 difference = glm::dvec4(filled.nodes[i]) - reference.nodes[i];
        density_error += difference.w * difference.w;
        density += reference.nodes[i].w * reference.nodes[i].w;
        // Weighed with the hair that is there: where there is hardly any, a mean is of rounding.
        const glm::dvec3 off(difference);
        velocity_error += reference.nodes[i].w * glm::dot(off, off);
        const glm::dvec3 mean(reference.nodes[i]);
        velocity += reference.nodes[i].w * glm::dot(mean, mean);
      }
      EXPECT_LT(std::sqrt(density_error / density), 1e-5) << resolution << ' ' << smoothing;
      EXPECT_LT(std::sqrt(velocity_error / velocity), 1e-4) << resolution << ' ' << smoothing;
    }
  }
}

TEST(HairVolume, IsTheSameBitsFromEverySetAndNumberOfThreads) {
  Hair hair = random_hair(1003, 16, 0.006f, 5);
  const Filled expected =
      fill(hair, {24, 1, own_workers(1), Priority::Simulation, simd::InstructionSet::Plain});
  for (const simd::InstructionSet set : simd::instruction_sets())
    for (const uint32_t threads : {1u, 2u, 4u}) {
      const Filled filled = fill(hair, {24, 1, own_workers(threads), Priority::Simulation, set});
      ASSERT_EQ(filled.volume.grid(), expected.volume.grid());
      EXPECT_EQ(std::memcmp(filled.nodes.data(), expected.nodes.data(), std::span(filled.nodes).size_bytes()),
                0)
          << simd::to_string(set) << ' ' << threads;
    }
}

TEST(HairVolume, TakesAllVerticesInOneCell) {
  Hair hair = random_hair(4000, 16, 0.004f, 6);
  const glm::dvec3 in_head(0.0512, 0.0523, 0.0531);
  for (size_t i = 0; i < hair.position_m.size(); ++i) {
    hair.position_m[i] = glm::vec3(hair.world_from_head * in_head);
    hair.velocity_mps[i] = hair.head_velocity_mps;
  }
  const Filled filled = fill(hair, {16, 0});
  EXPECT_EQ(filled.volume.outside_count(), 0u);
  EXPECT_NEAR(sum_of_lengths(filled) / filled.volume.length_m(), 1.0, 1e-6);
}

TEST(HairVolume, TakesEveryVertexInACellOfItsOwn) {
  Hair hair = random_hair(512, 16, 0.004f, 7);
  hair.world_from_head = {1.0, 0.0, 0.0, 0.0};
  hair.velocity_mps.assign(hair.velocity_mps.size(), hair.head_velocity_mps);
  Result<HairVolume> volume = HairVolume::make(strands_of(hair.layout), {32, 0});
  ASSERT_TRUE(volume);
  const float cell_m = volume->cell_m();
  for (uint32_t i = 0; i < hair.position_m.size(); ++i) {
    const glm::uvec3 cell(i % 21, (i / 21) % 21, i / 441);
    hair.position_m[i] = cell_m * (glm::vec3(cell) - 10.0f + 0.5f);
  }
  const Filled filled = fill(hair, {32, 0});
  EXPECT_EQ(filled.volume.outside_count(), 0u);
  EXPECT_NEAR(sum_of_lengths(filled) / filled.volume.length_m(), 1.0, 1e-6);
}

TEST(HairVolume, TurnsWithTheHead) {
  Hair hair = random_hair(300, 16, 0.006f, 8);
  hair.velocity_mps.assign(hair.velocity_mps.size(), hair.head_velocity_mps);
  for (size_t i = 0; i < hair.position_m.size(); ++i)
    hair.position_m[i] = glm::vec3(hair.world_from_head * glm::dvec3(hair.layout.rest[i]));
  const Filled turned = fill(hair, {24, 1});
  hair.world_from_head = {1.0, 0.0, 0.0, 0.0};
  for (size_t i = 0; i < hair.position_m.size(); ++i) hair.position_m[i] = glm::vec3(hair.layout.rest[i]);
  const Filled upright = fill(hair, {24, 1});
  for (const glm::vec4& rest : hair.layout.rest) {
    const double a = sample_volume(turned.volume.grid(), turned.nodes, glm::dvec3(rest)).density_mpm3;
    const double b = sample_volume(upright.volume.grid(), upright.nodes, glm::dvec3(rest)).density_mpm3;
    ASSERT_NEAR(a / b, 1.0, 1e-4);
  }
}

TEST(HairVolume, CountsWhatIsOutside) {
  Hair hair = random_hair(100, 8, 0.006f, 9);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  hair.position_m[17] = glm::vec3(nan, 0.0f, 0.0f);
  hair.position_m[118] = glm::vec3(0.0f, 1e30f, 0.0f);
  hair.velocity_mps[219] = glm::vec3(0.0f, 0.0f, std::numeric_limits<float>::infinity());
  // So far that the grid cannot reach there, on two sides.
  hair.position_m[320] = glm::vec3(3.0f, 0.0f, 0.0f);
  hair.position_m[421] = glm::vec3(0.0f, -2.5f, 2.0f);
  const Filled filled = fill(hair, {16, 1});
  EXPECT_EQ(filled.volume.outside_count(), 5u);
  EXPECT_LE(filled.nodes.size(), filled.volume.most_nodes());
  for (const glm::vec4& node : filled.nodes)
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(std::isfinite(node[i]));
  EXPECT_NEAR(sum_of_lengths(filled) / filled.volume.length_m(), 1.0 - 5.0 / 800.0, 5e-3);
}

TEST(HairVolume, SlopeIsThatOfItsValues) {
  Hair hair = random_hair(300, 16, 0.006f, 10);
  const Filled filled = fill(hair, {24, 1});
  const double h_m = 1e-7;
  for (size_t i = 0; i < hair.layout.size(); i += 97) {
    const glm::dvec3 at(hair.layout.rest[i]);
    const VolumeSample here = sample_volume(filled.volume.grid(), filled.nodes, at);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 step(0.0);
      step[axis] = h_m;
      const double above = sample_volume(filled.volume.grid(), filled.nodes, at + step).density_mpm3;
      const double below = sample_volume(filled.volume.grid(), filled.nodes, at - step).density_mpm3;
      EXPECT_NEAR((above - below) / (2.0 * h_m), here.gradient_mpm4[axis],
                  1e-3 * glm::length(here.gradient_mpm4) + 1.0);
    }
  }
}

TEST(HairVolume, RefusesWhatHasNoVolume) {
  Hair hair = random_hair(10, 8, 0.006f, 11);
  EXPECT_THAT(HairVolume::make(strands_of(hair.layout), {4, 1}).error().to_string(),
              HasSubstr("volume.resolution is 4 (allowed: 8 to 128)"));
  EXPECT_THAT(HairVolume::make(strands_of(hair.layout), {32, 9}).error().to_string(),
              HasSubstr("volume.smoothing is 9 (allowed: 0 to 3)"));
  StrandLayout flat = hair.layout;
  for (glm::vec4& vertex : flat.rest) vertex = glm::vec4(0.1f, 0.1f, 0.1f, 0.0f);
  EXPECT_THAT(HairVolume::make(strands_of(flat), {}).error().to_string(), HasSubstr("there is no hair"));
  StrandLayout far = hair.layout;
  for (glm::vec4& vertex : far.rest) vertex.x += 80.0f;
  EXPECT_THAT(HairVolume::make(strands_of(far), {}).error().to_string(),
              HasSubstr("farther from the head joint"));
}

// E = 1/2 sum (D - T)^2 over the nodes, times a cell: what is looked up is its derivative by a vertex's
// place, per length of hair. Against differences of E in double.
TEST(VolumeExtras, TheSlopeOfTheExcessIsTheDerivativeOfTheEnergy) {
  Hair hair = random_hair(150, 12, 0.006f, 12);
  for (const uint32_t smoothing : {0u, 1u, 2u}) {
    const VolumeOptions options{16, smoothing};
    const Filled filled = fill(hair, options);
    const VolumeGrid& grid = filled.volume.grid();
    // The target is the same hair somewhere else, on a grid of its own.
    Hair other = random_hair(150, 12, 0.006f, 12);
    for (glm::vec3& point : other.position_m) point = 0.9f * point + glm::vec3(0.01f, -0.02f, 0.015f);
    const Filled wanted = fill(other, options);
    const TargetDensity target = make_target(wanted.volume.grid(), wanted.nodes);
    VolumeExtras extras(options);
    extras.update(grid, filled.nodes, &target, nullptr);
    std::vector<glm::vec4> excess(grid.size());
    for (size_t i = 0; i < excess.size(); ++i) {
      excess[i] = glm::vec4(glm::vec3(0.0f), extras.excess_mpm3()[i]);
      ASSERT_EQ(extras.wind_share()[i], 1.0f) << "no wind was asked for";
    }
    const auto target_at = [&](const glm::ivec3& lattice) {
      const glm::ivec3 node = lattice - target.grid.first;
      for (int axis = 0; axis < 3; ++axis)
        if (node[axis] < 0 || node[axis] >= static_cast<int>(target.grid.nodes[axis])) return 0.0;
      const glm::uvec3 at(node);
      return static_cast<double>(target.density_mpm3[target.grid.index(at.x, at.y, at.z)]);
    };
    const auto cell_m = static_cast<double>(grid.cell_m);
    const auto energy = [&](const std::vector<HairSample>& samples) {
      const ReferenceVolume volume = make_reference_volume(grid, samples, smoothing);
      double sum = 0.0;
      for (uint32_t z = 0; z < grid.nodes.z; ++z)
        for (uint32_t y = 0; y < grid.nodes.y; ++y)
          for (uint32_t x = 0; x < grid.nodes.x; ++x) {
            const double off =
                volume.nodes[grid.index(x, y, z)].w - target_at(grid.first + glm::ivec3(x, y, z));
            sum += 0.5 * off * off * cell_m * cell_m * cell_m;
          }
      return sum;
    };
    std::vector<HairSample> samples = hair.samples(1);
    ASSERT_EQ(samples.size(), filled.volume.sample_count());
    for (const size_t vertex : {17u, 400u, 901u, 1500u}) {
      const VolumeSample here = sample_volume(grid, excess, samples[vertex].in_head_m);
      const glm::dvec3 expected = samples[vertex].length_m * here.gradient_mpm4;
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStepM = 1e-6;
        const glm::dvec3 before = samples[vertex].in_head_m;
        samples[vertex].in_head_m[axis] = before[axis] + kStepM;
        const double above = energy(samples);
        samples[vertex].in_head_m[axis] = before[axis] - kStepM;
        const double below = energy(samples);
        samples[vertex].in_head_m = before;
        EXPECT_NEAR((above - below) / (2.0 * kStepM), expected[axis], 2e-3 * glm::length(expected))
            << smoothing;
      }
    }
  }
}

// A slab of hair of one density: what comes through is exp(-width x density x way), whatever the angle.
TEST(VolumeExtras, TheWindThroughASlabFallsExponentially) {
  VolumeGrid grid{0.01f, {-20, -20, -10}, {41, 41, 21}};
  constexpr float kDensity = 5000.0f;
  constexpr float kWidthM = 0.004f;
  for (int axis = 0; axis < 3; ++axis)
    for (const float tilt : {0.0f, 0.3f, -0.6f})
      for (const float sign : {1.0f, -1.0f}) {
        glm::uvec3 nodes(41u);
        nodes[axis] = 21u;
        grid.nodes = nodes;
        std::vector<glm::vec4> values(grid.size(), glm::vec4(0.0f));
        const auto visit = [&](const auto& work) {
          for (uint32_t z = 0; z < nodes.z; ++z)
            for (uint32_t y = 0; y < nodes.y; ++y)
              for (uint32_t x = 0; x < nodes.x; ++x) work(glm::uvec3(x, y, z), grid.index(x, y, z));
        };
        visit([&](const glm::uvec3& node, size_t i) {
          if (node[axis] >= 8 && node[axis] <= 12) values[i].w = kDensity;
        });
        glm::vec3 along(0.0f);
        along[axis] = sign;
        along[(axis + 1) % 3] = tilt;
        WindShadow shadow{glm::normalize(along), kWidthM};
        VolumeExtras extras({16, 1});
        extras.update(grid, values, nullptr, &shadow);
        // Five layers of nodes, half of whose cells are at either side of each.
        const double way_m = 0.05 / std::cos(std::atan(static_cast<double>(tilt)));
        const double through =
            std::exp(-static_cast<double>(kWidthM) * static_cast<double>(kDensity) * way_m);
        glm::uvec3 behind(20u);
        behind[axis] = sign > 0.0f ? 15u : 5u;
        glm::uvec3 before(20u);
        before[axis] = sign > 0.0f ? 5u : 15u;
        EXPECT_NEAR(extras.wind_share()[grid.index(behind.x, behind.y, behind.z)], through, 1e-4)
            << axis << ' ' << tilt;
        EXPECT_EQ(extras.wind_share()[grid.index(before.x, before.y, before.z)], 1.0f);
      }
}

// An element holds what is interpolated between: the numbers of a cell's four corners in a layer.
TEST(VolumeExtras, ElementsHoldTheCornersOfACell) {
  const VolumeGrid grid{0.01f, {0, 0, 0}, {5, 4, 3}};
  std::vector<float> values;
  for (size_t i = 0; i < grid.size(); ++i) values.push_back(static_cast<float>(i * i));
  std::vector<glm::vec4> elements(grid.size());
  pack_corners(grid, values, elements);
  for (uint32_t z = 0; z < 3; ++z)
    for (uint32_t y = 0; y + 1 < 4; ++y)
      for (uint32_t x = 0; x + 1 < 5; ++x)
        EXPECT_EQ(elements[grid.index(x, y, z)],
                  glm::vec4(values[grid.index(x, y, z)], values[grid.index(x + 1, y, z)],
                            values[grid.index(x, y + 1, z)], values[grid.index(x + 1, y + 1, z)]));
}

// Hair may lie in any layer that there is, and in others the next time.
TEST(HairVolume, ForgetsWhereTheHairWasBefore) {
  Hair hair = random_hair(300, 16, 0.006f, 13);
  HairVolume volume = std::move(HairVolume::make(strands_of(hair.layout), {24, 1})).value();
  const std::vector<glm::vec3> home_m = hair.position_m;
  std::vector<glm::vec4> nodes(volume.most_nodes());
  for (const float away_m : {0.3f, -0.4f, 0.0f}) {
    for (size_t i = 0; i < home_m.size(); ++i)
      hair.position_m[i] = home_m[i] + away_m * glm::vec3(hair.world_from_head * glm::dvec3(0.0, 0.0, 1.0));
    volume.update(hair.input(), nodes);
    const Filled expected = fill(hair, {24, 1});
    ASSERT_EQ(volume.grid(), expected.volume.grid()) << away_m;
    EXPECT_EQ(volume.outside_count(), expected.volume.outside_count());
    EXPECT_EQ(std::memcmp(nodes.data(), expected.nodes.data(), std::span(expected.nodes).size_bytes()), 0);
  }
}

}  // namespace
}  // namespace strandcast::hair_volume_test
