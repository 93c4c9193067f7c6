// The one list of scene fields with their ranges. Readers and writers of scene files walk it, and those of
// messages (common/wire) for look and camera, so that they cannot disagree. Names are those of scene.proto; a
// name that is missing there is a broken invariant, which the first test finds.
#pragma once

#include <algorithm>
#include <iterator>
#include <limits>

#include "common/base/picture_size.h"
#include "common/groom/distance_field.h"
#include "common/groom/procedural.h"
#include "common/scene/hair_color.h"
#include "common/scene/scene_desc.h"
#include "common/scene/shadow_methods.h"

namespace strandcast::scene_fields {

struct Range {
  double minimum = 0.0;
  double maximum = 0.0;
  const char* unit = "";  // printed after the range
};

// What a person can mean; wider only costs clear errors.
inline constexpr size_t kMaxNameBytes = 64;
inline constexpr size_t kMaxPathBytes = 4096;
inline constexpr size_t kMaxSolverParameters = 64;
inline constexpr double kMinDirectionLength = 1e-3;

inline constexpr Range kStrandCount{1, kMaxStrandCount, ""};
inline constexpr Range kVertexCount{kMinVertexCount, kMaxVertexCount, ""};
inline constexpr Range kResampledVertexCount{0, kMaxVertexCount, ""};
inline constexpr Range kFileVertexCount{0, kMaxSourceVertexCount, ""};
inline constexpr Range kStrandLength{0.005, kMaxGrownLengthM, "m"};
inline constexpr Range kLengthVariation{0.0, 0.95, ""};
inline constexpr Range kCurlRadius{0.0, kMaxCurlRadiusM, "m"};
inline constexpr Range kCurlTurns{0.0, kMaxCurlTurns, "turns"};
inline constexpr Range kSeed{0, std::numeric_limits<uint32_t>::max(), ""};
inline constexpr Range kUnit{0.0, 1e3, "m"};
inline constexpr Range kYaw{-360.0, 360.0, "degrees"};
inline constexpr Range kFileOrigin{-1e6, 1e6, "file units"};
inline constexpr Range kHeadRadius{0.0, 1.0, "m"};
inline constexpr Range kFieldResolution{kMinFieldResolution, kMaxFieldResolution, "cells"};
inline constexpr Range kSolverParameter{-std::numeric_limits<double>::max(),
                                        std::numeric_limits<double>::max(), ""};
inline constexpr Range kStepRate{10.0, 1000.0, "Hz"};
inline constexpr Range kSubsteps{1, 64, ""};
inline constexpr Range kGravity{-1000.0, 1000.0, "m/s^2"};
inline constexpr Range kFollicleLimit{1.0, 180.0, "degrees"};  // 180 = free
inline constexpr Range kBendAngle{0.0, 180.0, "degrees"};
inline constexpr Range kHairFriction{0.0, 1e4, "1/s"};
inline constexpr Range kHairRepulsion{0.0, 1e6, "1/s^2"};
inline constexpr Range kWindWidth{0.0, 1.0, "m"};
inline constexpr Range kRestDensityScale{0.1, 100.0, ""};
inline constexpr Range kVolumeResolution{8, 128, "cells"};
inline constexpr Range kVolumeSmoothing{0, 3, "passes"};
inline constexpr Range kVolumeInterval{1, 100, "steps"};
inline constexpr Range kHairs{1.0, 1e7, "hairs"};
inline constexpr Range kLockWidth{0.001, 1.0, "m"};
inline constexpr Range kFullAtPx{1.0, 10'000.0, "pixels"};
inline constexpr Range kHysteresis{0.0, 0.9, ""};
inline constexpr Range kWaitingTime{0.0, 3600.0, "s"};
inline constexpr Range kSimulatedShare{0.001, 1.0, ""};
inline constexpr Range kColliderCenter{-kMaxGroomExtentM, kMaxGroomExtentM, "m"};
inline constexpr Range kColliderRadius{1e-4, 10.0, "m"};
inline constexpr Range kBodyFriction{0.0, 10.0, ""};
inline constexpr Range kTipClearance{kBodyClearanceM, 0.1, "m"};
inline constexpr Range kBodyForce{0.0, 1e6, "1/s^2"};
inline constexpr Range kBeltSpeed{-100.0, 100.0, "m/s"};
inline constexpr Range kJointOffset{-1.0, 1.0, "m"};
inline constexpr Range kWindSpeed{-100.0, 100.0, "m/s"};
inline constexpr Range kGustIntensity{0.0, 3.0, ""};
inline constexpr Range kGustLength{0.1, 1000.0, "m"};
inline constexpr Range kFraction{0.0, 1.0, ""};
inline constexpr Range kDirection{-1e3, 1e3, ""};
inline constexpr Range kHeadPlace{-1000.0, 1000.0, "m"};
inline constexpr Range kStreamBound{1e-6, 5e-4, "m"};
inline constexpr Range kFrameWidth{kMinPictureSide, kMaxPictureWidth, "pixels"};
inline constexpr Range kFrameHeight{kMinPictureSide, kMaxPictureHeight, "pixels"};
inline constexpr Range kJpegQuality{1, 100, ""};
inline constexpr Range kFrameRate{0.1, 240.0, "Hz"};
inline constexpr Range kStrandRate{0.0, 1000.0, "Hz"};  // 0 = every step
inline constexpr Range kUdpPort{0, 65'535, ""};         // 0 = the protocol's own
inline constexpr Range kLiveDelay{0.0, 200.0, "ms"};
inline constexpr Range kLiveScale{kMinLiveScale, kMaxLiveScale, ""};
inline constexpr Range kDatagramSize{64, 65'507, "bytes"};
inline constexpr size_t kMaxHostBytes = 253;  // of a name in the DNS

template <class Visitor>
void visit_groom(Visitor& v, GroomDesc& groom) {
  if (!v.chooses("file", std::holds_alternative<FileGroomDesc>(groom))) {
    auto* procedural = std::get_if<ProceduralGroomDesc>(&groom);
    if (!procedural) procedural = &groom.emplace<ProceduralGroomDesc>();
    v.group("procedural", [&] {
      v.number("strand_count", procedural->strand_count, kStrandCount);
      v.number("vertex_count", procedural->vertex_count, kVertexCount);
      v.number("length_m", procedural->length_m, kStrandLength);
      v.number("length_variation", procedural->length_variation, kLengthVariation);
      v.number("curl_radius_m", procedural->curl_radius_m, kCurlRadius);
      v.number("curl_turns", procedural->curl_turns, kCurlTurns);
      v.number("seed", procedural->seed, kSeed);
    });
    return;
  }
  auto* file = std::get_if<FileGroomDesc>(&groom);
  if (!file) file = &groom.emplace<FileGroomDesc>();
  v.group("file", [&] {
    v.path("path", file->path);
    v.require("path", !file->path.empty(),
              "is empty: name the groom file, for example --set groom.file.path=FILE.tfx");
    v.number("unit_m", file->unit_m, kUnit);
    file->has_up_axis = v.chooses("up_axis", file->has_up_axis);
    if (file->has_up_axis) v.choice("up_axis", file->up_axis, UpAxis::MinusZ);
    file->has_origin = v.chooses("origin", file->has_origin);
    if (file->has_origin) v.vector("origin", file->origin, kFileOrigin);
    v.number("vertex_count", file->vertex_count, kResampledVertexCount);
    v.require("vertex_count", file->vertex_count == 0 || file->vertex_count >= kMinVertexCount,
              "is 1, it must be 0 (keep) or within 2 .. 64");
    file->has_pinning = v.chooses("pinning", file->has_pinning);
    if (file->has_pinning) v.choice("pinning", file->pinning, Pinning::BothEnds);
    file->has_yaw = v.chooses("yaw_deg", file->has_yaw);
    if (file->has_yaw) v.number("yaw_deg", file->yaw_deg, kYaw);
    v.paths("more_paths", file->more_paths, kMaxGroomFiles - 1);
    v.number("strand_vertex_count", file->strand_vertex_count, kFileVertexCount);
    v.require("strand_vertex_count", file->strand_vertex_count != 1,
              "is 1, a strand has at least 2 vertices");
    v.flag("guides", file->guides);
  });
}

template <class Visitor>
void visit_methods(Visitor& v, RenderMethodsDesc& methods) {
  const auto method = [&](const char* name, std::string& chosen, const auto& table) {
    v.text(name, chosen, kMaxNameBytes);
    v.require(name, table.has(chosen), table.refusal());
  };
  method("shading", methods.shading, shading_models());
  method("scattering", methods.scattering, scattering_models());
  method("evaluation", methods.evaluation, shading_places());
  method("shadow", methods.shadow, shadow_methods());
  method("transparency", methods.transparency, transparency_methods());
  method("antialiasing", methods.antialiasing, antialiasing_methods());
  method("curve", methods.curve, curve_methods());
  method("joints", methods.joints, joint_methods());
  method("detail", methods.detail, detail_methods());
  method("culling", methods.culling, culling_methods());
  method("shadow_detail", methods.shadow_detail, shadow_details());
  const char* const conflict = method_conflict(methods);
  v.require("transparency", *conflict == '\0', conflict);
}

/// Returns whether a direction or offset is long enough to have a direction.
inline bool points_somewhere(const glm::vec3& way) {
  return glm::length(way) >= static_cast<float>(kMinDirectionLength);
}

// schema begin: look fields
// clang-format off
template <class Visitor>
void visit_style(Visitor& v, StrandStyleDesc& m) {
  v.number("clump", m.clump, Range{0, 1, ""});
  v.number("locks", m.locks, Range{1, 16, ""});
  v.number("spread", m.spread, Range{0, 1, ""});
  v.number("wave_m", m.wave_m, Range{0, 0.1, "m"});
  v.number("wave_count", m.wave_count, Range{0, 64, "waves"});
  v.number("frizz_m", m.frizz_m, Range{0, 0.1, "m"});
  v.number("frizz_count", m.frizz_count, Range{0, 64, "waves"});
  v.number("stray_share", m.stray_share, Range{0, 1, ""});
  v.number("stray_spread", m.stray_spread, Range{0, 20, ""});
  v.number("length_spread", m.length_spread, Range{0, 1, ""});
  v.number("short_share", m.short_share, Range{0, 1, ""});
  v.number("tip_fade", m.tip_fade, Range{0, 1, ""});
}
template <class Visitor>
void visit_shading(Visitor& v, HairShadingDesc& m) {
  v.number("diffuse", m.diffuse, Range{0, 10, ""});
  v.number("scatter", m.scatter, Range{0, 10, ""});
  v.number("highlight", m.highlight, Range{0, 10, ""});
  v.number("transmission", m.transmission, Range{0, 10, ""});
  v.number("second_highlight", m.second_highlight, Range{0, 10, ""});
  v.number("highlight_width_deg", m.highlight_width_deg, Range{1, 45, "degrees"});
  v.number("cuticle_deg", m.cuticle_deg, Range{-15, 15, "degrees"});
  v.number("cuticle_spread_deg", m.cuticle_spread_deg, Range{0, 30, "degrees"});
  v.number("root_darkening", m.root_darkening, Range{0, 1, ""});
  v.number("strand_variation", m.strand_variation, Range{0, 1, ""});
  v.number("lock_variation", m.lock_variation, Range{0, 1, ""});
  v.number("warmth_variation", m.warmth_variation, Range{0, 1, ""});
  v.number("wetness", m.wetness, Range{0, 1, ""});
}
template <class Visitor>
void visit_look(Visitor& v, LookDesc& m) {
  v.text("hair_color", m.hair_color, kMaxNameBytes);
  v.require("hair_color", is_hair_color(m.hair_color), kHairColorSentence);
  v.color("root_color", m.root_color, Range{0, 1, ""});
  v.color("tip_color", m.tip_color, Range{0, 1, ""});
  v.number("eumelanin", m.eumelanin, Range{0, 10, ""});
  v.number("pheomelanin", m.pheomelanin, Range{0, 10, ""});
  v.number("strand_radius_m", m.strand_radius_m, Range{1e-6, 0.01, "m"});
  v.number("tip_scale", m.tip_scale, Range{0, 1, ""});
  v.number("followers", m.followers, Range{0, 64, ""});
  v.number("segments", m.segments, Range{1, 8, ""});
  v.group("style", [&] { visit_style(v, m.style); });
  v.group("shading", [&] { visit_shading(v, m.shading); });
  v.vector("light_direction", m.light_direction, Range{-1e3, 1e3, ""});
  v.require("light_direction", points_somewhere(m.light_direction), "must point somewhere");
  v.color("light_color", m.light_color, Range{0, 100, ""});
  v.vector("rim_direction", m.rim_direction, Range{-1e3, 1e3, ""});
  v.require("rim_direction", points_somewhere(m.rim_direction), "must point somewhere");
  v.color("rim_color", m.rim_color, Range{0, 100, ""});
  v.number("ambient", m.ambient, Range{0, 1, ""});
  v.number("exposure", m.exposure, Range{0, 100, ""});
  v.color("background", m.background, Range{0, 1, ""});
  v.color("skin_color", m.skin_color, Range{0, 1, ""});
  v.group("methods", [&] { visit_methods(v, m.methods); });
}
template <class Visitor>
void visit_camera(Visitor& v, CameraDesc& m) {
  v.vector("offset_m", m.offset_m, Range{-100, 100, "m"});
  v.require("offset_m", points_somewhere(m.offset_m), "is almost zero, it must be at least 0.001 m long");
  v.vector("target_m", m.target_m, Range{-100, 100, "m"});
  v.number("fov_y_rad", m.fov_y_rad, Range{0.02, 2.8, "rad"});
}
// clang-format on
// schema end

template <class Visitor>
void visit_stream(Visitor& v, StreamDesc& stream) {
  // What is not the default was chosen by somebody.
  stream.has_codec = v.chooses("codec", stream.has_codec || stream.codec != StreamDesc().codec);
  if (stream.has_codec) v.text("codec", stream.codec, kMaxNameBytes);
  v.require(
      "codec",
      stream.codec == "delta" || stream.codec == "raw" || stream.codec == "step" || stream.codec == "tangent",
      "is unknown (known: delta, raw, step, tangent)");
  v.number("bound_m", stream.bound_m, kStreamBound);
  v.number("frame_width", stream.frame_width, kFrameWidth);
  v.number("frame_height", stream.frame_height, kFrameHeight);
  v.number("jpeg_quality", stream.jpeg_quality, kJpegQuality);
  v.number("frame_rate_hz", stream.frame_rate_hz, kFrameRate);
  v.number("strand_rate_hz", stream.strand_rate_hz, kStrandRate);
}

template <class Visitor>
void visit_body(Visitor& v, BodyDesc& body) {
  v.text("preset", body.preset, kMaxNameBytes);
  v.require("preset", body.preset == kNoBody || body.preset == kUpperBody,
            "is unknown (known: none, upper_body)");
  v.repeated("capsules", body.capsules, kMaxBodyCapsules, [&](BodyCapsuleDesc& capsule) {
    const auto joint = [&](const char* name, std::string& value) {
      if (v.chooses(name, !value.empty())) v.text(name, value, kMaxJointNameBytes);
    };
    joint("from_joint", capsule.from_joint);
    joint("to_joint", capsule.to_joint);
    v.vector("from_m", capsule.from_m, kColliderCenter);
    v.vector("to_m", capsule.to_m, kColliderCenter);
    v.number("from_radius_m", capsule.from_radius_m, kColliderRadius);
    v.number("to_radius_m", capsule.to_radius_m, kColliderRadius);
  });
  v.require("capsules", preset_size(body.preset) + body.capsules.size() <= kMaxBodyCapsules,
            "with those of the preset are more than 16");
  v.repeated("planes", body.planes, kMaxBodyPlanes, [&](BodyPlaneDesc& plane) {
    v.vector("point_m", plane.point_m, kColliderCenter);
    v.vector("normal", plane.normal, kDirection);
    v.require("normal", glm::length(plane.normal) >= kMinDirectionLength, "must point somewhere");
    v.vector("velocity_mps", plane.velocity_mps, kBeltSpeed);
  });
  v.text("response", body.response, kMaxNameBytes);
  v.require("response",
            std::find(kBodyResponses.begin(), kBodyResponses.end(), body.response) != kBodyResponses.end(),
            "is unknown (known: turn, sphere, project, force)");
  v.number("friction", body.friction, kBodyFriction);
  v.number("tip_clearance_m", body.tip_clearance_m, kTipClearance);
  v.number("force_per_s2", body.force_per_s2, kBodyForce);
  v.vector("joint_offset_m", body.joint_offset_m, kJointOffset);
}

template <class Visitor>
void visit_live(Visitor& v, LiveDesc& live) {
  v.text("protocol", live.protocol, kMaxNameBytes);
  v.require("protocol", !live.protocol.empty(), "is empty, it must name a protocol, such as vmc");
  const auto text = [&](const char* name, std::string& value, size_t limit) {
    if (v.chooses(name, !value.empty())) v.text(name, value, limit);
  };
  text("host", live.host, kMaxHostBytes);
  v.number("port", live.port, kUdpPort);
  text("subject", live.subject, kMaxNameBytes);
  text("axes", live.axes, kMaxNameBytes);
  text("version", live.version, kMaxNameBytes);
  v.flag("takes_zero_positions", live.takes_zero_positions);
  v.flag("turns_only", live.turns_only);
  v.number("delay_ms", live.delay_ms, kLiveDelay);
  v.number("max_datagram_bytes", live.max_datagram_bytes, kDatagramSize);
  v.number("scale", live.scale, kLiveScale);
}

/// Returns whether all heads of a scene have different names.
inline bool have_own_names(const SceneDesc& scene) {
  std::vector<std::string> names = {scene.name};
  for (const SceneDesc& head : scene.heads) names.push_back(head.name);
  std::sort(names.begin(), names.end());
  return std::adjacent_find(names.begin(), names.end()) == names.end();
}

/// Calls the visitor for every field of `scene`, in the order of scene.proto.
template <class Visitor>
void visit_scene(Visitor& v, SceneDesc& scene) {
  v.text("name", scene.name, kMaxNameBytes);
  v.group("groom", [&] {
    visit_groom(v, scene.groom);
    v.number("hairs", scene.volume.air.hairs, kHairs);
  });
  v.group("head", [&] {
    v.path("mesh_path", scene.head.mesh_path);
    v.number("radius_m", scene.head.radius_m, kHeadRadius);
    v.flag("is_visible", scene.head.is_visible);
    scene.head.has_center = v.chooses("center_m", scene.head.has_center);
    if (scene.head.has_center) v.vector("center_m", scene.head.center_m, kColliderCenter);
    v.paths("more_mesh_paths", scene.head.more_mesh_paths, kMaxMeshFiles - 1);
    v.require("more_mesh_paths", scene.head.more_mesh_paths.empty() || !scene.head.mesh_path.empty(),
              "needs mesh_path, the first of them");
    v.text("collider", scene.head.collider, kMaxNameBytes);
    v.require("collider", scene.head.collider == kSphereCollider || scene.head.collider == kFieldCollider,
              "is unknown (known: field, spheres)");
    v.number("field_resolution", scene.head.field_resolution, kFieldResolution);
  });
  v.group("solver", [&] {
    v.text("name", scene.solver.name, kMaxNameBytes);
    v.map("parameters", scene.solver.parameters, kSolverParameter, kMaxSolverParameters);
  });
  v.text("quality", scene.quality, kMaxNameBytes);
  v.require("quality",
            scene.quality == kCustomQuality || scene.quality == kAutoQuality ||
                scene.quality == kFastQuality || scene.quality == kFullQuality,
            "is unknown (known: auto, fast, full, custom)");
  v.group("hair", [&] {
    for (const HairControl& control : kHairControls)
      v.number(control.name, scene.hair.*control.value, {control.minimum, control.maximum, control.unit});
  });
  v.number("step_rate_hz", scene.step_rate_hz, kStepRate);
  v.number("substeps", scene.substeps, kSubsteps);
  v.vector("gravity_mps2", scene.gravity_mps2, kGravity);
  v.repeated("colliders", scene.colliders, kMaxSphereColliders, [&](SphereCollider& collider) {
    v.vector("center_m", collider.center_m, kColliderCenter);
    v.number("radius_m", collider.radius_m, kColliderRadius);
  });
  v.flag("has_auto_collider", scene.has_auto_collider);
  v.group("wind", [&] {
    v.vector("mean_mps", scene.wind.mean_mps, kWindSpeed);
    v.number("gust_intensity", scene.wind.gust_intensity, kGustIntensity);
    v.number("gust_length_m", scene.wind.gust_length_m, kGustLength);
    v.number("seed", scene.wind.seed, kSeed);
    v.number("along_share", scene.wind.along_share, kFraction);
  });
  v.group("look", [&] { visit_look(v, scene.look); });
  v.group("camera", [&] { visit_camera(v, scene.camera); });
  v.group("stream", [&] { visit_stream(v, scene.stream); });
  v.number("follicle_limit_deg", scene.follicle_limit_deg, kFollicleLimit);
  v.group("bend_limit", [&] {
    BendLimitDesc& limit = scene.bend_limit;
    v.number("least_root_deg", limit.least_root_deg, kBendAngle);
    v.number("least_tip_deg", limit.least_tip_deg, kBendAngle);
    v.number("most_root_deg", limit.most_root_deg, kBendAngle);
    v.number("most_tip_deg", limit.most_tip_deg, kBendAngle);
    v.require("most_root_deg", limit.most_root_deg >= limit.least_root_deg, "is less than least_root_deg");
    v.require("most_tip_deg", limit.most_tip_deg >= limit.least_tip_deg, "is less than least_tip_deg");
  });
  v.group("volume", [&] {
    v.number("friction_per_s", scene.volume.friction_per_s, kHairFriction);
    v.number("repulsion_per_s2", scene.volume.repulsion_per_s2, kHairRepulsion);
    v.number("target_per_s2", scene.volume.target_per_s2, kHairRepulsion);
    v.number("wind_width_m", scene.volume.wind_width_m, kWindWidth);
    v.number("rest_density_scale", scene.volume.rest_density_scale, kRestDensityScale);
    v.number("resolution", scene.volume.resolution, kVolumeResolution);
    v.number("smoothing", scene.volume.smoothing, kVolumeSmoothing);
    v.number("interval", scene.volume.interval, kVolumeInterval);
    v.text("integration", scene.volume.integration, kMaxNameBytes);
    v.require("integration", scene.volume.integration == "implicit" || scene.volume.integration == "explicit",
              "is unknown (known: implicit, explicit)");
    v.text("scatter", scene.volume.scatter, kMaxNameBytes);
    v.require("scatter",
              std::find(std::begin(kVolumeScatters), std::end(kVolumeScatters), scene.volume.scatter) !=
                  std::end(kVolumeScatters),
              "is unknown (known: auto, host, sort, atomics)");
  });
  v.group("air", [&] {
    v.flag("acts", scene.volume.air.acts);
    v.number("lock_width_m", scene.volume.air.lock_width_m, kLockWidth);
  });
  v.group("body", [&] { visit_body(v, scene.body); });
  v.group("detail", [&] {
    DetailDesc& detail = scene.detail;
    v.text("mode", detail.mode, kMaxNameBytes);
    v.require("mode", detail.mode == kDetailOff || detail.mode == kDetailAuto,
              "is unknown (known: auto, off)");
    v.number("full_at_px", detail.full_at_px, kFullAtPx);
    v.number("hysteresis", detail.hysteresis, kHysteresis);
    v.number("settle_s", detail.settle_s, kWaitingTime);
    v.number("simulated_share", detail.simulated_share, kSimulatedShare);
    v.number("far_share", detail.far_share, kSimulatedShare);
    v.text("idle", detail.idle, kMaxNameBytes);
    v.require("idle", detail.idle == kIdleFollow || detail.idle == kIdleFull,
              "is unknown (known: follow, full)");
    v.number("idle_after_s", detail.idle_after_s, kWaitingTime);
  });
  const bool has_target = v.chooses("target_groom", scene.target_groom.has_value());
  if (!has_target) scene.target_groom.reset();
  if (has_target && !scene.target_groom) scene.target_groom.emplace();
  if (has_target) v.group("target_groom", [&] { visit_groom(v, *scene.target_groom); });
  v.repeated("live", scene.live, kMaxLiveInputs, [&](LiveDesc& live) { visit_live(v, live); });
  if (v.chooses("place_m", scene.place_m != glm::dvec3(0.0))) v.vector("place_m", scene.place_m, kHeadPlace);
  v.repeated("heads", scene.heads, kMaxHeads - 1, [&](SceneDesc& head) { visit_scene(v, head); });
  v.require("heads", have_own_names(scene),
            "need a name each that no other head of the scene has: heads { name: \"ben\" .. }");
}

}  // namespace strandcast::scene_fields
