#include "server/report/truth_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "common/base/file.h"
#include "common/pictures/linear_png.h"
#include "common/scene/scene_file.h"
#include "server/report/scene_run.h"
#include "server/report/stream_motion.h"

namespace strandcast {
namespace {

constexpr float kMostPngValue = 65535.0f;
constexpr uint64_t kMostPoseBytes = 4u << 20;
constexpr const char* kPoseCodec = "tangent";
constexpr double kPoseSeconds = 2.0;  // hair has settled into the motion

using NamedFields = std::map<std::string, std::vector<std::string>>;

std::vector<std::string> camera_from(float x, float y, float z, float target_y) {
  return {fmt::format("camera.offset_m.x={}", x), fmt::format("camera.offset_m.y={}", y),
          fmt::format("camera.offset_m.z={}", z), fmt::format("camera.target_m.y={}", target_y)};
}

const NamedFields& camera_fields() {
  static const NamedFields kFields = {
      {"front", {}},  // the built-in scene's own
      {"side", camera_from(-0.66f, 0.07f, -0.05f, -0.055f)},
      {"back", camera_from(-0.12f, 0.09f, -0.65f, -0.055f)},
      {"turned", camera_from(0.5f, 0.12f, 0.42f, -0.055f)},
      {"near", camera_from(0.13f, 0.08f, 0.37f, 0.03f)},
      {"far", camera_from(0.66f, 0.21f, 1.88f, -0.055f)},
  };
  return kFields;
}

const NamedFields& light_fields() {
  static const std::vector<std::string> kNoRim = {"look.rim_color.r=0", "look.rim_color.g=0",
                                                  "look.rim_color.b=0"};
  static const std::vector<std::string> kNoKey = {"look.light_color.r=0", "look.light_color.g=0",
                                                  "look.light_color.b=0"};
  static const auto with = [](std::vector<std::string> fields, const std::vector<std::string>& more) {
    fields.insert(fields.end(), more.begin(), more.end());
    return fields;
  };
  static const NamedFields kFields = {
      {"all", {}},
      {"against", with(kNoRim, {"look.light_direction.x=0.1", "look.light_direction.y=-0.35",
                                "look.light_direction.z=0.93"})},
      {"key", with(kNoRim, {"look.ambient=0"})},
      {"rim", with(kNoKey, {"look.ambient=0"})},
      {"sky", with(with(kNoKey, kNoRim), {"look.ambient=1"})},
  };
  return kFields;
}

/// Colours of root and tip that the truths were made with: presets may change, and these do not.
const NamedFields& color_fields() {
  static const auto custom = [](const std::array<float, 6>& rgb) {
    std::vector<std::string> fields = {"look.hair_color=custom"};
    const char* names[] = {"root_color.r", "root_color.g", "root_color.b",
                           "tip_color.r",  "tip_color.g",  "tip_color.b"};
    for (size_t i = 0; i < rgb.size(); ++i) fields.push_back(fmt::format("look.{}={}", names[i], rgb[i]));
    return fields;
  };
  static const NamedFields kFields = {
      {"black", custom({0.010f, 0.008f, 0.007f, 0.019f, 0.015f, 0.013f})},
      {"brown", custom({0.070f, 0.033f, 0.016f, 0.190f, 0.092f, 0.040f})},
      {"blond", custom({0.360f, 0.225f, 0.100f, 0.640f, 0.455f, 0.240f})},
      {"red", custom({0.230f, 0.058f, 0.018f, 0.430f, 0.130f, 0.038f})},
      {"grey", custom({0.300f, 0.300f, 0.310f, 0.500f, 0.500f, 0.510f})},
  };
  return kFields;
}

// Fitted or held out in turn, so that both have every kind of hair, light and place.
constexpr bool kFitted = true;
constexpr bool kHeldOut = false;

/// A plane of a truth as the colours of a PNG.
LinearImage packed(uint32_t width, uint32_t height, const std::function<glm::vec3(size_t)>& value) {
  LinearImage image{width, height, {}};
  for (size_t i = 0; i < size_t{width} * height; ++i) {
    const glm::vec3 v = glm::clamp(value(i), 0.0f, 1.0f);
    for (int k = 0; k < 3; ++k) image.rgb.push_back(static_cast<uint16_t>(v[k] * kMostPngValue + 0.5f));
  }
  return image;
}

glm::vec3 unpacked(const LinearImage& image, size_t i) {
  return glm::vec3(image.rgb[3 * i], image.rgb[3 * i + 1], image.rgb[3 * i + 2]) / kMostPngValue;
}

}  // namespace

std::string TruthView::name() const {
  std::string text =
      camera + "_" + color + (light == "all" ? "" : "_" + light) + (pose == "rest" ? "" : "_" + pose);
  std::replace(text.begin(), text.end(), ' ', '_');
  return text;
}

std::vector<std::string> TruthView::overrides() const {
  constexpr std::string_view kWet = "wet ";
  std::vector<std::string> fields = camera_fields().at(camera);
  const std::vector<std::string>& of_light = light_fields().at(light);
  fields.insert(fields.end(), of_light.begin(), of_light.end());
  const bool is_wet = color.starts_with(kWet);
  const std::vector<std::string>& of_color = color_fields().at(is_wet ? color.substr(kWet.size()) : color);
  fields.insert(fields.end(), of_color.begin(), of_color.end());
  if (is_wet) fields.emplace_back("look.shading.wetness=1");
  return fields;
}

const std::vector<TruthView>& truth_views() {
  static const std::vector<TruthView> kViews = {
      {"front", "brown", "all", "rest", kFitted},      {"front", "blond", "all", "rest", kFitted},
      {"front", "black", "all", "rest", kHeldOut},     {"front", "red", "all", "rest", kHeldOut},
      {"front", "grey", "all", "rest", kFitted},       {"front", "wet brown", "all", "rest", kFitted},
      {"front", "brown", "key", "rest", kFitted},      {"front", "brown", "rim", "rest", kHeldOut},
      {"front", "brown", "sky", "rest", kFitted},      {"front", "blond", "against", "rest", kFitted},
      {"front", "brown", "against", "rest", kHeldOut}, {"front", "blond", "sky", "rest", kHeldOut},
      {"front", "black", "key", "rest", kHeldOut},     {"front", "blond", "rim", "rest", kFitted},
      {"side", "brown", "all", "rest", kHeldOut},      {"side", "red", "all", "rest", kFitted},
      {"back", "brown", "all", "rest", kFitted},       {"back", "blond", "all", "rest", kHeldOut},
      {"turned", "black", "all", "rest", kFitted},     {"turned", "grey", "against", "rest", kHeldOut},
      {"near", "brown", "all", "rest", kHeldOut},      {"near", "blond", "all", "rest", kFitted},
      {"far", "brown", "all", "rest", kFitted},        {"far", "wet brown", "all", "rest", kHeldOut},
      {"front", "brown", "all", "walk", kHeldOut},     {"turned", "blond", "against", "walk", kFitted},
      {"side", "red", "all", "shake", kHeldOut},       {"front", "brown", "all", "shake", kHeldOut},
  };
  return kViews;
}

std::filesystem::path default_truth_folder() {
  std::error_code failure;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failure).parent_path();
  // A build's programs are in build/PRESET/bin.
  const std::filesystem::path sources = own / "../../../server/report/truth";
  if (std::filesystem::is_directory(sources, failure)) return sources.lexically_normal();
  return own.parent_path() / "share/strandcast/truth";
}

Result<ViewTruth> load_truth(const std::filesystem::path& folder, const TruthView& view) {
  ASSIGN_OR_RETURN(const LinearImage light, load_linear_png(folder / (view.name() + ".png")));
  ASSIGN_OR_RETURN(const LinearImage cover,
                   load_linear_png(folder / ("cover_" + view.cover_name() + ".png")));
  if (light.width != cover.width || light.height != cover.height)
    return at(folder.string(),
              make_error(ErrorCode::BadInput, "the cover of {} has another size", view.name()));
  ViewTruth truth{{light.width, light.height, {}}, {cover.width, cover.height, {}, {}}};
  for (size_t i = 0; i < size_t{light.width} * light.height; ++i) {
    truth.light.light.push_back(kMostLight * unpacked(light, i));
    truth.cover.hair.push_back(unpacked(cover, i).x);
    truth.cover.skin.push_back(unpacked(cover, i).y);
  }
  return truth;
}

Status keep_truth(const std::filesystem::path& folder, const TruthView& view, const ViewTruth& truth) {
  const auto light = [&](size_t i) { return truth.light.light[i] / kMostLight; };
  const auto cover = [&](size_t i) { return glm::vec3(truth.cover.hair[i], truth.cover.skin[i], 0.0f); };
  RETURN_IF_ERROR(
      save_linear_png(folder / (view.name() + ".png"), packed(truth.light.width, truth.light.height, light)));
  return save_linear_png(folder / ("cover_" + view.cover_name() + ".png"),
                         packed(truth.cover.width, truth.cover.height, cover));
}

Result<std::shared_ptr<const Snapshot>> load_pose(const std::filesystem::path& folder,
                                                  const std::string& pose, const SceneAsset& asset) {
  const std::filesystem::path path = folder / (pose + ".strands");
  ASSIGN_OR_RETURN(const auto bytes, load_file(path, kMostPoseBytes));
  ASSIGN_OR_RETURN(const auto decoder,
                   make_strand_decoder(kPoseCodec, {asset.strand_count, asset.vertex_count}));
  auto state = decoder->decode(bytes);
  if (!state) return at(path.string(), state.error());
  return state;
}

Status keep_pose(const std::filesystem::path& folder, const std::string& pose) {
  ASSIGN_OR_RETURN(const SceneDesc scene, built_in_scene_with({fmt::format("stream.codec={}", kPoseCodec)}));
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  ASSIGN_OR_RETURN(const auto executor, open_executor({"lanes", "auto", {}}));
  ASSIGN_OR_RETURN(const auto run, SceneRun::make(scene, content, {}, *executor));
  const StreamMotion motion = built_in_stream_motions()[pose == "walk" ? 1 : 2];
  const auto steps = static_cast<uint64_t>(kPoseSeconds * scene.step_rate_hz);
  for (uint64_t step = 1; step <= steps; ++step)
    RETURN_IF_ERROR(run->step(motion.head_at(static_cast<double>(step) / scene.step_rate_hz)));
  ASSIGN_OR_RETURN(const auto state, run->publish());
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder(kPoseCodec));
  const EncodedFramePtr frame = encoder->encode(*state);
  if (frame == nullptr) return make_error(ErrorCode::Internal, "the state of {} could not be encoded", pose);
  return save_file(folder / (pose + ".strands"), frame->message);
}

}  // namespace strandcast
