// SceneFeatures: the only place that decides what runs. Passes, buffers and shader variants ask nothing else.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Facts that may change while running, kept apart from the scene's own.
/// How much of the simulation runs: each level leaves out what the one before it does, and more.
enum class DetailLevel {
  Full,
  NoHairHair,     // hair does not act on hair
  FewerStrands,   // DetailDesc::far_share of them, which the others follow
  FewerVertices,  // every kFarVertexStride-th of a strand's, and its tip
  HalfRate,       // every other step, twice as long
  FollowHead      // none: hair goes with the head as it is
};
inline constexpr size_t kDetailLevels = 6;
inline constexpr uint32_t kFarVertexStride = 2;

struct RuntimeFacts {
  bool has_wind_stream = false;
  uint32_t strand_viewers = 0;
  uint32_t frame_viewers = 0;
  DetailLevel detail = DetailLevel::Full;
  std::string detail_reason = {};  // of a level that is not Full
  /// Facts by name that hold whatever decides otherwise: to measure what leaving them out saves. A fact that
  /// needs something loaded (has_distance_field) stays without it.
  std::vector<std::string> forced = {};
};

/// Positive facts; all false = the barest simulation.
struct SceneFeatures {
  bool has_wind = false;        // mean, gusts or a wind stream
  bool has_turbulence = false;  // wind varies over the head
  bool has_colliders = false;
  bool has_follicle_limit = false;    // roots lean only so far
  bool has_bend_limit = false;        // segments bend only so far
  bool has_oriented_drag = false;     // air drags hair less along its length than across
  bool has_volume = false;            // hair acts on hair
  bool has_distance_field = false;    // the head collides as one, not as spheres
  bool has_body = false;              // strands meet capsules and planes of a body
  bool has_followed_strands = false;  // only the first strands are simulated, the others follow them
  bool has_fewer_vertices = false;    // only some vertices of a strand are simulated
  bool has_half_rate = false;         // every other step, twice as long
  bool is_carried = false;            // hair goes with the head as it is: there are no steps
  bool has_strand_viewers = false;
  bool has_frame_viewers = false;

  bool operator==(const SceneFeatures&) const = default;
};

/// "full", "no hair-hair", "fewer strands", "fewer vertices", "half rate", "follow the head".
const char* to_string(DetailLevel level);

SceneFeatures analyse(const SceneDesc& scene, const RuntimeFacts& facts);
/// Share of the strands that is simulated, the first of them; in (0, 1].
double simulated_share(const SceneDesc& scene, const RuntimeFacts& facts);
/// Below this there is no half rate: states would come too rarely to be shown smoothly.
inline constexpr double kLeastHalvedRateHz = 40.0;

/// One fact in words: name, value, and why it has that value ("scene.wind has no mean and no gusts").
struct FeatureReason {
  std::string name;
  bool value = false;
  std::string reason;
};
std::vector<FeatureReason> explain(const SceneDesc& scene, const RuntimeFacts& facts);

/// A fact's value with its cause.
struct Fact {
  bool value = false;
  std::string reason;
};

/// What of a picture there is to draw, and what the methods that the look names need for it: for the server's
/// frames and for viewers, who have no scene file.
struct PictureFeatures {
  Fact has_strands;
  Fact has_followers;
  Fact has_head_mesh;
  Fact has_lobe_tables;      // of a smooth fibre, by angles and absorption
  Fact has_scatter_tables;   // what such fibres scatter forward and back, by inclination and absorption
  Fact has_density_normals;  // of the volume that the strands fill
  Fact is_shaded_per_fragment;
  ShadingModel shading = ShadingModel::Sadeghi;
  ScatteringModel scattering = ScatteringModel::Volume;
};

PictureFeatures analyse_picture(const SceneAsset& asset, const LookDesc& look);
std::vector<FeatureReason> explain(const PictureFeatures& features);

}  // namespace strandcast
