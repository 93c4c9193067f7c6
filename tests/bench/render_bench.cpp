// Prints CSV: what every method of self-shadowing, transparency and antialiasing costs and how far its
// pictures are from the truth, on the built-in scene at rest: near, and from four times as far.
//   render_bench [--size WxH] [--rounds N] [--png DIR] [--tiles yes]
// CPU time of the process, on all threads; methods take turns, so that whatever else runs meets all alike.
// `ratio` is to today's quads (volume, hashed, analytic). `rmse` is over the pixels that hair covers, in sRGB
// of 0..1: of shadows against the picture with the deep shadow map, everything else alike; of the others at
// half the size, against lists of four times as many pixels. The latter has the detail of the larger picture,
// which the level of detail takes from all methods alike.
// With --tiles nothing but the tiles on the processor: near, far and from so near that the head fills the
// picture; with the detail they choose against all that a look allows; and shadows by lattices of more and
// fewer cells against those of 128. `rmse` of the former is to the finest detail.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>

#include "common/base/quantile.h"
#include "common/gl/egl_context.h"
#include "common/groom/groom_asset.h"
#include "common/render/renderer.h"
#include "common/render/tiles/tile_renderer.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

constexpr float kFar = 4.0f;         // times the distance
constexpr float kClose = 0.4f;       // likewise
constexpr uint32_t kTruthScale = 2;  // per side

struct Options {
  RenderSize size{1280, 720};
  int rounds = 5;
  std::filesystem::path png;
  bool is_tiles = false;
};

struct Row {
  const char* kind;
  RenderMethods methods;
};

std::string name_of(const RenderMethods& methods) {
  return fmt::format("{}+{}+{}", shadow_methods().rows()[static_cast<size_t>(methods.shadow)].name,
                     transparency_methods().rows()[static_cast<size_t>(methods.transparency)].name,
                     antialiasing_methods().rows()[static_cast<size_t>(methods.antialiasing)].name);
}

/// The default, then each method with the default of the other kinds; shadows over lists, so that only they
/// differ from the truth.
std::vector<Row> all_rows() {
  std::vector<Row> rows{{"default", {}}};
  for (size_t i = 0; i < shadow_methods().rows().size(); ++i)
    rows.push_back({"shadow", {static_cast<ShadowMethod>(i), TransparencyMethod::Lists, {}}});
  for (size_t i = 1; i < transparency_methods().rows().size(); ++i)
    rows.push_back({"transparency", {{}, static_cast<TransparencyMethod>(i), {}}});
  for (size_t i = 1; i < antialiasing_methods().rows().size(); ++i)
    rows.push_back({"antialiasing", {{}, {}, static_cast<AntialiasingMethod>(i)}});
  return rows;
}

Result<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i], value = argv[i + 1];
    if (word == "--rounds") {
      options.rounds = std::max(1, std::atoi(value.c_str()));
    } else if (word == "--png") {
      options.png = value;
    } else if (word == "--tiles") {
      options.is_tiles = value == "yes";
    } else if (word != "--size" ||
               std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2) {
      return make_error(ErrorCode::BadInput,
                        "unknown option {} {} (known: --size WxH --rounds N --png DIR --tiles yes)", word,
                        value);
    }
  }
  return options;
}

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

double srgb(double value) {
  return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

/// The mean of blocks of pixels, in linear light.
std::vector<double> shrunk(const Image& image, uint32_t scale) {
  std::vector<double> of_byte(256);
  for (size_t i = 0; i < of_byte.size(); ++i) of_byte[i] = linear(static_cast<double>(i) / 255.0);
  const uint32_t width = image.width / scale, height = image.height / scale;
  std::vector<double> small(size_t{width} * height * 3);
  for (uint32_t y = 0; y < height * scale; ++y)
    for (uint32_t x = 0; x < width * scale; ++x)
      for (size_t c = 0; c < 3; ++c)
        small[(size_t{y / scale} * width + x / scale) * 3 + c] +=
            of_byte[image.rgba[(size_t{y} * image.width + x) * 4 + c]] / (scale * scale);
  for (double& value : small) value = srgb(value);
  return small;
}

/// Over pixels where the truth with hair differs from the one without.
double rmse(const std::vector<double>& a, const std::vector<double>& truth, const std::vector<double>& bald) {
  constexpr double kSeen = 2.0 / 255.0;
  double sum = 0.0;
  size_t count = 0;
  for (size_t i = 0; i + 2 < truth.size(); i += 3) {
    double hair = 0.0;
    for (size_t c = i; c < i + 3; ++c) hair = std::max(hair, std::abs(truth[c] - bald[c]));
    if (hair < kSeen) continue;
    for (size_t c = i; c < i + 3; ++c) sum += (a[c] - truth[c]) * (a[c] - truth[c]);
    count += 3;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

class Bench {
 public:
  Bench(const Options& options, const gl::DeviceInfo& device, const SceneDesc& scene, const SceneAsset& asset)
      : options_(options), device_(device), scene_(scene), asset_(asset) {}

  Status view(const char* name, const CameraDesc& camera) {
    const RenderSize half{options_.size.width / kTruthScale, options_.size.height / kTruthScale};
    SceneAsset bald = asset_;
    bald.strand_count = bald.vertex_count = 0;
    bald.rest_position_m.clear();
    bald.triangle.clear();
    ASSIGN_OR_RETURN(const Image head, picture(bald, camera, {}, options_.size));
    ASSIGN_OR_RETURN(const Image lists,
                     picture(asset_, camera, {{}, TransparencyMethod::Lists, {}}, options_.size));
    ASSIGN_OR_RETURN(
        const Image shadowed,
        picture(asset_, camera, {ShadowMethod::DeepShadow, TransparencyMethod::Lists, {}}, options_.size));
    std::vector<Measured> all;
    for (const Row& row : all_rows()) {
      Measured one{row, nullptr, {}, 0.0};
      if (std::string(row.kind) != "shadow") {
        ASSIGN_OR_RETURN(const Image small, picture(asset_, camera, row.methods, half));
        one.error = rmse(shrunk(small, 1), shrunk(lists, kTruthScale), shrunk(head, kTruthScale));
      }
      ASSIGN_OR_RETURN(one.renderer, make(asset_, row.methods));
      RETURN_IF_ERROR(one.renderer->draw(posed(asset_), camera, options_.size));  // compiles
      const Image image = one.renderer->read_image();
      if (std::string(row.kind) == "shadow")
        one.error = rmse(shrunk(image, 1), shrunk(shadowed, 1), shrunk(head, 1));
      if (!options_.png.empty())
        RETURN_IF_ERROR(save_png(options_.png / fmt::format("{}_{}.png", name, name_of(row.methods)), image));
      all.push_back(std::move(one));
    }
    for (int round = 0; round < options_.rounds; ++round)
      for (Measured& one : all) {
        const double begin_ms = cpu_ms();
        RETURN_IF_ERROR(one.renderer->draw(posed(asset_), camera, options_.size));
        (void)one.renderer->read_image();
        one.ms.push_back(cpu_ms() - begin_ms);
      }
    print(name, all);
    return {};
  }

 private:
  struct Measured {
    Row row;
    std::unique_ptr<Renderer> renderer;
    std::vector<double> ms;
    double error = 0.0;
  };
  void print(const char* view_name, const std::vector<Measured>& all) const {
    const double base_ms = median(all.front().ms);
    for (const Measured& one : all)
      fmt::print("{},{}x{},{},{},{:.0f},{:.2f},{:.1f},{:.4f},{}\n", view_name, options_.size.width,
                 options_.size.height, one.row.kind, name_of(one.row.methods), median(one.ms),
                 median(one.ms) / base_ms, static_cast<double>(one.renderer->passes().live_bytes()) * 1e-6,
                 one.error, one.renderer->profile().left_out_fragments);
    std::fflush(stdout);
  }
  static PosedStrands posed(const SceneAsset& asset) { return {{}, asset.rest_position_m}; }
  Result<std::unique_ptr<Renderer>> make(const SceneAsset& asset, const RenderMethods& methods) {
    return Renderer::make(gl::ShaderLibrary(), device_, asset, scene_.look, segment_path_with(methods));
  }
  Result<Image> picture(const SceneAsset& asset, const CameraDesc& camera, const RenderMethods& methods,
                        RenderSize size) {
    ASSIGN_OR_RETURN(auto renderer, make(asset, methods));
    RETURN_IF_ERROR(renderer->draw(posed(asset), camera, size));
    return renderer->read_image();
  }

  const Options& options_;
  const gl::DeviceInfo& device_;
  const SceneDesc& scene_;
  const SceneAsset& asset_;
};

/// The tiles on the processor, by one view: each setting against the finest of its kind.
Status bench_tiles(const char* name, const Options& options, const SceneDesc& scene,
                   const SceneAsset& asset) {
  struct Setting {
    const char* kind;
    std::string name;
    TileOptions tiles;
    std::unique_ptr<Renderer> renderer;
    std::vector<double> picture, ms;
  };
  const auto detail_of = [](bool is_finest) {
    TileOptions tiles;
    tiles.is_finest = is_finest;
    return tiles;
  };
  std::vector<Setting> settings;
  settings.push_back({"detail", "finest", detail_of(true), nullptr, {}, {}});
  settings.push_back({"detail", "chosen", detail_of(false), nullptr, {}, {}});
  for (const uint32_t cells : {128u, kLightCells, 96u, 64u, 32u}) {
    settings.push_back({"light cells", fmt::format("{}", cells), {}, nullptr, {}, {}});
    settings.back().tiles.light_cells = cells;
  }
  SceneAsset bald = asset;
  bald.strand_count = bald.vertex_count = 0;
  bald.rest_position_m.clear();
  bald.triangle.clear();
  const auto draw = [&](Renderer& renderer, const SceneAsset& of) {
    return renderer.draw({{}, of.rest_position_m}, scene.camera, options.size);
  };
  ASSIGN_OR_RETURN(auto without, make_tile_renderer(bald, scene.look));
  RETURN_IF_ERROR(draw(*without, bald));
  const std::vector<double> head = shrunk(without->read_image(), 1);
  for (Setting& setting : settings) {
    ASSIGN_OR_RETURN(setting.renderer, make_tile_renderer(asset, scene.look, setting.tiles));
    RETURN_IF_ERROR(draw(*setting.renderer, asset));
    setting.picture = shrunk(setting.renderer->read_image(), 1);
  }
  for (int round = 0; round < options.rounds; ++round)
    for (Setting& setting : settings) {
      const double begin_ms = cpu_ms();
      RETURN_IF_ERROR(draw(*setting.renderer, asset));
      setting.ms.push_back(cpu_ms() - begin_ms);
    }
  const Setting* finest = nullptr;
  for (const Setting& setting : settings) {
    if (finest == nullptr || setting.kind != finest->kind) finest = &setting;
    fmt::print("{},{}x{},{},{},{:.0f},{:.2f},{:.1f},{:.4f},{}\n", name, options.size.width,
               options.size.height, setting.kind, setting.name, median(setting.ms),
               median(setting.ms) / median(finest->ms),
               static_cast<double>(setting.renderer->passes().live_bytes()) * 1e-6,
               rmse(setting.picture, finest->picture, head), setting.renderer->profile().drawn_segments);
  }
  std::fflush(stdout);
  return {};
}

Status bench_tiles(const Options& options, SceneDesc scene, const SceneAsset& asset) {
  fmt::print("view,size,kind,setting,cpu_ms,ratio,megabytes,rmse,segments\n");
  const glm::vec3 offset_m = scene.camera.offset_m;
  RETURN_IF_ERROR(bench_tiles("near", options, scene, asset));
  scene.camera.offset_m = offset_m * kFar;
  RETURN_IF_ERROR(bench_tiles("far", options, scene, asset));
  scene.camera.offset_m = offset_m * kClose;
  return bench_tiles("close", options, scene, asset);
}

Status run(int argc, char** argv) {
  ASSIGN_OR_RETURN(const Options options, parse(argc, argv));
  if (!options.png.empty()) std::filesystem::create_directories(options.png);
  const SceneDesc scene = built_in_scene();
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  if (options.is_tiles) return bench_tiles(options, scene, asset);
  ASSIGN_OR_RETURN(const auto context, gl::EglContext::make("auto"));
  fmt::print("view,size,kind,method,cpu_ms,ratio,megabytes,rmse,left_out\n");
  Bench bench(options, context->info(), scene, asset);
  CameraDesc camera = scene.camera;
  RETURN_IF_ERROR(bench.view("near", camera));
  camera.offset_m *= kFar;
  return bench.view("far", camera);
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const strandcast::Status status = strandcast::run(argc, argv);
  if (!status) std::fprintf(stderr, "%s\n", status.error().to_string().c_str());
  return status ? 0 : 2;
}
