// SceneDesc: a validated scene in SI units. Made by scene_file.h from protobuf text
// (proto/strandcast/v1/scene.proto) or by built_in_scene(); all later stages read only this. Plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/groom_file.h"
#include "common/kernels/volume/volume_desc.h"
#include "common/math/pose.h"
#include "common/math/sphere_collider.h"
#include "common/scene/body_desc.h"
#include "common/scene/hair_controls.h"
#include "common/scene/live_desc.h"
#include "common/scene/render_methods.h"

namespace strandcast {

enum class UpAxis { Y, Z, MinusY, MinusZ };

/// Hair grown along the normals of a hemispherical scalp mesh.
struct ProceduralGroomDesc {
  uint32_t strand_count = 2000;
  uint32_t vertex_count = 16;
  float length_m = 0.28f;
  float length_variation = 0.12f;  // relative, uniform +-
  float curl_radius_m = 0.006f;    // 0 = straight
  float curl_turns = 2.2f;         // along the strand
  uint32_t seed = 1;

  bool operator==(const ProceduralGroomDesc&) const = default;
};

struct FileGroomDesc {
  std::filesystem::path path;  // .tfx, .hair, .ply, .usd or .abc
  std::vector<std::filesystem::path>
      more_paths;       // further parts of the same hair, at most kMaxGroomFiles - 1
  float unit_m = 0.0f;  // metres per file unit; 0 = as the file says, else guessed from the size of the head
  UpAxis up_axis = UpAxis::Y;
  bool has_up_axis = false;  // false: as the file says, else guessed from the hair
  float yaw_deg = 0.0f;      // about the up axis, counter-clockwise seen from above
  bool has_yaw = false;      // false: guessed from the hairline
  glm::vec3 origin{0.0f};  // point of the file (in file units, after the up axis) that becomes the head joint
  bool has_origin = false;    // false: the middle of the head under the roots
  uint32_t vertex_count = 0;  // resample to this many; 0 = keep (rounded into the limits)
  Pinning pinning = Pinning::RootPair;
  bool has_pinning = false;          // false: as the file says
  bool guides = false;               // guides beside other strands are the hair; false: the others are
  uint32_t strand_vertex_count = 0;  // of a .ply: points of one strand; 0 = as the file says, else guessed

  bool operator==(const FileGroomDesc&) const = default;
};

inline constexpr size_t kMaxMeshFiles = 8;  // that one head is drawn from

/// Wind of the scene itself; a connected wind stream replaces it.
struct WindDesc {
  glm::vec3 mean_mps{0.0f};     // world
  float gust_intensity = 0.0f;  // standard deviation over mean speed, 0 = steady
  float gust_length_m = 9.0f;   // integral length of the turbulence
  uint32_t seed = 1;
  float along_share = 1.0f;  // of the drag across a hair, what there is along it: 0.5 = a thin cylinder

  bool operator==(const WindDesc&) const = default;
};

/// Greatest angles between successive segments at root and tip. The bends of the groom at rest are always
/// allowed.
struct BendLimitDesc {
  double least_root_deg = 0.0;
  double least_tip_deg = 0.0;
  double most_root_deg = 180.0;
  double most_tip_deg = 180.0;

  bool acts() const {
    return least_root_deg > 0.0 || least_tip_deg > 0.0 || most_root_deg < 180.0 || most_tip_deg < 180.0;
  }
  bool operator==(const BendLimitDesc&) const = default;
};

/// Values of DetailDesc::mode and ::idle.
inline constexpr const char* kDetailOff = "off";
inline constexpr const char* kDetailAuto = "auto";
inline constexpr const char* kIdleFollow = "follow";
inline constexpr const char* kIdleFull = "full";

/// How the amount of simulation depends on the readers and on the size of the hair on their screens.
struct DetailDesc {
  std::string mode = kDetailOff;   // kDetailOff: whoever reads gets all of it; kDetailAuto: by size
  double full_at_px = 240.0;       // height of the hair on a screen from which on all of it is simulated
  double hysteresis = 0.25;        // a smaller level only this share below its size, 0 .. 0.9
  double settle_s = 2.0;           // and only after so long
  double simulated_share = 1.0;    // of strands, at the most: the first; the others follow them
  double far_share = 0.25;         // likewise from DetailLevel::FewerStrands on
  std::string idle = kIdleFollow;  // nobody reads: kIdleFollow, hair goes with the head; or kIdleFull
  double idle_after_s = 10.0;      // for so long

  bool operator==(const DetailDesc&) const = default;
};

struct SolverDesc {
  std::string name = "dftl";
  std::map<std::string, double> parameters;  // by the names in the solver's table row; missing = its default

  bool operator==(const SolverDesc&) const = default;
};

/// Values of HeadDesc::collider.
inline constexpr const char* kSphereCollider = "spheres";
inline constexpr const char* kFieldCollider = "field";

struct HeadDesc {
  std::filesystem::path mesh_path;  // OBJ in the groom's units and axes; empty = built-in head
  std::vector<std::filesystem::path> more_mesh_paths;  // further parts, at most kMaxMeshFiles - 1
  float radius_m = 0.095f;                             // of the built-in cranium; 0 = fitted to the roots
  bool is_visible = true;
  glm::vec3 center_m{0.0f};                // of the built-in cranium, head space
  bool has_center = false;                 // false: at the head joint, or fitted to the roots of a groom file
  std::string collider = kSphereCollider;  // what of it strands meet, drawn or not
  uint32_t field_resolution = 64;          // of kFieldCollider: cells along the longest side of the mesh

  bool operator==(const HeadDesc&) const = default;
};

// schema begin: look
// clang-format off
/// How drawn strands lie between and beside the simulated ones; none of it moves a root.
struct StrandStyleDesc {
  float clump = 0.8f;  // 0..1: how far tips are drawn together into locks
  uint32_t locks = 5;  // per root triangle, 1..16
  float spread = 0.012f;  // how far a tip strays from its lock, of the mean strand length
  float wave_m = 0.004f;  // amplitude of the waves that a lock's strands share, at the tip
  float wave_count = 3.0f;  // waves along a strand
  float frizz_m = 0.0006f;  // amplitude of each strand's own small waves
  float frizz_count = 9.0f;
  float stray_share = 0.04f;  // of strands: they leave their lock
  float stray_spread = 3.5f;  // how much further than others these stray
  float length_spread = 0.18f;  // 0..1: largest part that a strand is shorter by
  float short_share = 0.1f;  // of strands: broken ones, much shorter
  float tip_fade = 0.2f;  // last part of a strand, over which it fades out
  bool operator==(const StrandStyleDesc&) const = default;
};
/// How a strand takes the light.
struct HairShadingDesc {
  float diffuse = 0.42f;
  float scatter = 0.5f;  // light that comes through other strands
  float highlight = 1.0f;  // R: the light's colour, from the surface
  float transmission = 1.0f;  // TT, seen against the light
  float second_highlight = 1.0f;  // TRT: coloured, nearer to the root
  float highlight_width_deg = 7.5f;
  float cuticle_deg = 3.5f;  // tilt of the scales: moves the highlights apart
  float cuticle_spread_deg = 5.0f;  // from strand to strand
  float root_darkening = 0.45f;  // 0..1, over the first quarter of a strand
  float strand_variation = 0.22f;  // 0..1, of brightness from strand to strand
  float lock_variation = 0.12f;  // from lock to lock
  float warmth_variation = 0.08f;  // 0..1, of red against blue
  float wetness = 0.0f;  // 0 dry .. 1 dripping: darker, clumped, sharp highlights
  bool operator==(const HairShadingDesc&) const = default;
};
struct LookDesc {
  // "custom": root_color and tip_color; "melanin": eumelanin and pheomelanin; or a preset: black, brown, ...
  std::string hair_color = "custom";
  glm::vec3 root_color{0.045f, 0.019f, 0.008f};  // linear RGB, 0..1
  glm::vec3 tip_color{0.125f, 0.054f, 0.021f};
  float eumelanin = 1.3f;  // concentrations; brown to black
  float pheomelanin = 0.0f;  // yellow to red
  float strand_radius_m = 0.00012f;  // as drawn: a drawn strand stands for several real ones
  float tip_scale = 0.25f;  // radius at the tip over radius at the root
  uint32_t followers = 3;  // drawn strands per root triangle, beside the key strands
  uint32_t segments = 3;  // drawn segments between two simulated vertices, 1..8
  StrandStyleDesc style;
  HairShadingDesc shading;
  glm::vec3 light_direction{-0.45f, -0.75f, -0.5f};  // travels this way, world
  glm::vec3 light_color{1.0f, 0.97f, 0.92f};
  glm::vec3 rim_direction{0.55f, -0.45f, 0.8f};  // the second light's
  glm::vec3 rim_color{0.45f, 0.48f, 0.55f};  // black: there is none
  float ambient = 0.22f;
  float exposure = 1.0f;
  glm::vec3 background{0.11f, 0.12f, 0.135f};
  glm::vec3 skin_color{0.55f, 0.38f, 0.29f};
  RenderMethodsDesc methods;
  LookDesc();
  LookDesc(const LookDesc&);
  LookDesc(LookDesc&&) noexcept;
  LookDesc& operator=(const LookDesc&);
  LookDesc& operator=(LookDesc&&) noexcept;
  ~LookDesc();
  bool operator==(const LookDesc&) const;
};
// clang-format on
// schema end
// schema begin: camera
// clang-format off
struct CameraDesc {
  glm::vec3 offset_m{0.22f, 0.07f, 0.62f};  // from the point looked at, world axes
  glm::vec3 target_m{0.0f, -0.055f, 0.0f};  // from the head joint, world axes
  float fov_y_rad = 0.61f;
  bool operator==(const CameraDesc&) const = default;
};
// clang-format on
// schema end

struct StreamDesc {
  std::string codec = "step";  // "step" (fewest bits), "tangent", "delta" (least time) or "raw"
  bool has_codec = false;      // false: nobody chose; a server may take another where it costs too much
  float bound_m = 1e-4f;       // announced Euclidean error bound, 1e-6 .. 5e-4
  uint32_t frame_width = 640, frame_height = 360;
  uint32_t jpeg_quality = 80;
  double frame_rate_hz = 15.0;  // rendered frames, at most
  double strand_rate_hz = 0.0;  // states of strands, at most; 0 = every step

  bool operator==(const StreamDesc&) const = default;
};

using GroomDesc = std::variant<ProceduralGroomDesc, FileGroomDesc>;

/// Values of SceneDesc::quality.
inline constexpr const char* kCustomQuality = "custom";
inline constexpr const char* kAutoQuality = "auto";
inline constexpr const char* kFastQuality = "fast";
inline constexpr const char* kFullQuality = "full";

inline constexpr size_t kMaxHeads = 8;  // of one scene, the scene's own among them

struct SceneDesc {
  std::string name = "default";
  GroomDesc groom;
  HeadDesc head;
  std::string quality = kCustomQuality;  // where solver, volume, air and head.collider come from
  HairControls hair;                     // factors on all that
  SolverDesc solver;
  double step_rate_hz = 60.0;  // 10 .. 1000
  uint32_t substeps = 1;       // 1 .. 64
  glm::dvec3 gravity_mps2{0.0, -9.81, 0.0};
  double follicle_limit_deg = 20.0;  // most that a root leans from its groomed direction, 1 .. 180 (= free)
  std::vector<SphereCollider> colliders;
  bool has_auto_collider = true;  // the head as it is drawn, when `colliders` is empty
  VolumeDesc volume;
  std::optional<GroomDesc>
      target_groom;  // to which volume.target_per_s2 drives the hair's volume; none: its own
  BendLimitDesc bend_limit;
  DetailDesc detail;
  BodyDesc body;
  std::vector<LiveDesc> live;  // at most kMaxLiveInputs; none: no socket of it is opened
  WindDesc wind;
  LookDesc look;
  CameraDesc camera;
  StreamDesc stream;
  glm::dvec3 place_m{0.0};  // of the head: added to where its source says that it is, world
  // Further heads, at most kMaxHeads - 1: whole scenes with names of their own, without heads.
  std::vector<SceneDesc> heads = {};

  // Out of line: copied and taken apart in many files, which need no copy of that code.
  SceneDesc();
  SceneDesc(const SceneDesc&);
  SceneDesc(SceneDesc&&) noexcept;
  SceneDesc& operator=(const SceneDesc&);
  SceneDesc& operator=(SceneDesc&&) noexcept;
  ~SceneDesc();
  bool operator==(const SceneDesc&) const;
};

/// Returns the scene that runs without a file: 2,000 procedural strands x 16 vertices, head, gentle gusts.
SceneDesc built_in_scene();

}  // namespace strandcast
