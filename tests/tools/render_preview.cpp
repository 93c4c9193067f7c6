// render_preview: draws a scene's hair at rest into a PNG, without server or simulation. For looking at the
// renderer.
//   render_preview OUT.png [--scene FILE] [--set path=value]... [--size WxH] [--repeat N] [--turn DEGREES]
//   [--shaders DIR] [--renderer tiles|gl|quads] [--threads N] [--light-cells N]; methods by --set
//   look.methods.shadow=...
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <glm/gtc/constants.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/gl/egl_context.h"
#include "common/groom/groom_asset.h"
#include "common/pictures/image_codec.h"
#include "common/render/renderer.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

struct Options {
  std::string out;
  std::string scene;
  std::string shaders;  // folder to read shaders from instead of the binary
  std::vector<std::string> overrides;
  RenderSize size;
  int repeat = 1;
  double turn_degrees = 0.0;  // of the head about the vertical
  std::string renderer = "tiles";
  uint32_t threads = 0;  // 0: the workers that all share
  TileOptions tiles;
};

Result<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--", 0) != 0) {
      options.out = word;
      continue;
    }
    if (++i >= argc) return make_error(ErrorCode::BadInput, "option {} needs a value", word);
    const std::string value = argv[i];
    if (word == "--scene") {
      options.scene = value;
    } else if (word == "--shaders") {
      options.shaders = value;
    } else if (word == "--set") {
      options.overrides.push_back(value);
    } else if (word == "--repeat") {
      options.repeat = std::max(1, std::atoi(value.c_str()));
    } else if (word == "--turn") {
      options.turn_degrees = std::atof(value.c_str());
    } else if (word == "--renderer") {
      options.renderer = value;
    } else if (word == "--threads") {
      options.threads = static_cast<uint32_t>(std::clamp(std::atoi(value.c_str()), 1, int{kMaxWorkers}));
    } else if (word == "--light-cells") {
      options.tiles.light_cells = static_cast<uint32_t>(std::max(1, std::atoi(value.c_str())));
    } else if (word == "--size") {
      if (std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2)
        return make_error(ErrorCode::BadInput, "--size is {} but must look like 640x360", value);
    } else {
      return make_error(
          ErrorCode::BadInput,
          "unknown option {} (known: --scene --set --shaders --size --repeat --turn --renderer --threads "
          "--light-cells)",
          word);
    }
  }
  if (options.out.empty()) return make_error(ErrorCode::BadInput, "name the PNG file to write");
  return options;
}

Status run(int argc, char** argv) {
  ASSIGN_OR_RETURN(Options options, parse(argc, argv));
  WorkerPool own(std::max(options.threads, 1u));
  if (options.threads > 0) options.tiles.workers = &own;
  auto loaded = options.scene.empty() ? built_in_scene_with(options.overrides)
                                      : load_scene(options.scene, options.overrides);
  ASSIGN_OR_RETURN(const SceneDesc scene, std::move(loaded));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  const gl::ShaderLibrary shaders =
      options.shaders.empty() ? gl::ShaderLibrary() : gl::ShaderLibrary(options.shaders);
  std::unique_ptr<gl::EglContext> context;
  std::unique_ptr<Renderer> renderer;
  std::string device =
      fmt::format("tiles, {} threads, {}", options.tiles.workers->size(), to_string(options.tiles.set));
  if (options.renderer != "tiles") {
    ASSIGN_OR_RETURN(context, gl::EglContext::make("auto"));
    const RenderPath& path = options.renderer == "quads" ? segment_path() : path_for(scene.look);
    ASSIGN_OR_RETURN(renderer, Renderer::make(shaders, context->info(), asset, scene.look, path));
    device = context->info().renderer;
  } else {
    ASSIGN_OR_RETURN(renderer, make_tile_renderer(asset, scene.look, options.tiles));
  }

  PosedStrands strands;
  strands.position_m = asset.rest_position_m;
  strands.world_from_head.rotation =
      glm::angleAxis(glm::radians(options.turn_degrees), glm::dvec3(0.0, 1.0, 0.0));
  std::vector<double> picture_ms;
  std::clock_t cpu_begin = 0;
  for (int i = 0; i < options.repeat; ++i) {
    if (i <= 1) cpu_begin = std::clock();  // the first picture compiles
    const int64_t begin_ns = now_ns();
    RETURN_IF_ERROR(renderer->draw(strands, scene.camera, options.size));
    const Image image = renderer->read_image();
    picture_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
    if (i == 0) RETURN_IF_ERROR(save_png(options.out, image));
  }
  const double cpu_ms =
      1e3 * static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC / std::max(1, options.repeat - 1);
  std::sort(picture_ms.begin(), picture_ms.end());
  const RenderProfile& profile = renderer->profile();
  std::string passes;
  for (const gl::PassReport& pass : renderer->passes().report())
    passes += fmt::format(", {} {:.1f}", pass.name, pass.median_ms);
  std::printf(
      "%s: %ux%u, %llu strands, %llu segments, %llu fragments left out, %.1f MB; picture %.1f ms "
      "(best %.1f), %.1f ms of CPU%s\n",
      device.c_str(), options.size.width, options.size.height,
      static_cast<unsigned long long>(profile.drawn_strands),
      static_cast<unsigned long long>(profile.drawn_segments),
      static_cast<unsigned long long>(profile.left_out_fragments),
      static_cast<double>(renderer->passes().live_bytes()) * 1e-6, picture_ms[picture_ms.size() / 2],
      picture_ms.front(), cpu_ms, passes.c_str());
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const strandcast::Status status = strandcast::run(argc, argv);
  if (!status) std::fprintf(stderr, "%s\n", status.error().to_string().c_str());
  return status ? 0 : 2;
}
