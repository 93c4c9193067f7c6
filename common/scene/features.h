// SceneFeatures: the only place that decides what runs. Passes, buffers and shader variants depend on nothing
// else.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// How much of the simulation runs. Each level leaves out more than the one before it. It may change while
/// running, unlike the facts of the scene.
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
  /// Names of facts that are forced to be true, to measure what leaving them out saves. A fact that needs
  /// loaded data (has_distance_field) stays false without it.
  std::vector<std::string> forced = {};
};

/// Facts about a scene, all positive; if all are false, the simulation is the barest one.
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

/// Returns the name of a level: "full", "no hair-hair", "fewer strands", "fewer vertices", "half rate",
/// "follow the head".
const char* to_string(DetailLevel level);

SceneFeatures analyse(const SceneDesc& scene, const RuntimeFacts& facts);
/// Returns the share of strands that is simulated, in (0, 1]; it is a prefix of all strands.
double simulated_share(const SceneDesc& scene, const RuntimeFacts& facts);
/// Lowest rate at which half rate is used; below it, states would be too rare to be shown smoothly.
inline constexpr double kLeastHalvedRateHz = 40.0;

/// One fact for people: its name, value and reason ("scene.wind has no mean and no gusts").
struct FeatureReason {
  std::string name;
  bool value = false;
  std::string reason;
};
std::vector<FeatureReason> explain(const SceneDesc& scene, const RuntimeFacts& facts);

/// A fact's value and its reason.
struct Fact {
  bool value = false;
  std::string reason;
};

/// What there is to draw in a picture, and what the drawing methods named by the look need. Used for the
/// server's pictures and by viewers, who have no scene file.
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
