#include "client/app/recording_film.h"

#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "client/app/recording_player.h"
#include "common/base/frame_rate.h"
#include "common/log/progress.h"
#include "common/pictures/webm_writer.h"
#include "common/render/renderer.h"

namespace strandcast {
namespace {

/// Where the number stands in a name, and in how many digits.
struct NumberPlace {
  size_t begin = 0, end = 0;
  int digits = 1;
};

std::optional<NumberPlace> number_place(const std::string& name) {
  const size_t begin = name.find('%');
  if (begin == std::string::npos) return std::nullopt;
  size_t at = begin + 1;
  NumberPlace place{begin, 0, 1};
  if (at < name.size() && name[at] == '0') ++at;
  if (at < name.size() && name[at] >= '1' && name[at] <= '9') place.digits = name[at++] - '0';
  if (at >= name.size() || name[at] != 'd' || name.find('%', at) != std::string::npos) return std::nullopt;
  place.end = at + 1;
  return place;
}

/// Takes pictures, and completes what it makes of them.
struct Film {
  std::function<Status(const Image&)> add;
  std::function<Status()> finish;
};

Result<Film> open_film(const std::filesystem::path& path, const ViewOptions& options) {
  if (path.has_parent_path()) {
    std::error_code failure;
    std::filesystem::create_directories(path.parent_path(), failure);
    if (failure) return at(path.string(), make_error(ErrorCode::BadInput, "{}", failure.message()));
  }
  if (path.extension() == ".webm") {
    ASSIGN_OR_RETURN(auto made,
                     WebmWriter::make(path, {options.size.width, options.size.height, options.film_fps}));
    auto writer = std::make_shared<WebmWriter>(std::move(made));
    return Film{[writer](const Image& image) { return writer->add(image); },
                [writer] { return writer->finish(); }};
  }
  if (path.extension() == ".webp") {
    ASSIGN_OR_RETURN(auto made, ClipWriter::make(path, options.film_fps));
    auto writer = std::make_shared<ClipWriter>(std::move(made));
    return Film{[writer](const Image& image) { return writer->add(image); },
                [writer] { return writer->finish(); }};
  }
  auto number = std::make_shared<uint64_t>(0);
  return Film{[path, number](const Image& image) { return save_png(numbered_path(path, ++*number), image); },
              [] { return Status(); }};
}

}  // namespace

std::filesystem::path numbered_path(const std::filesystem::path& pattern, uint64_t number) {
  std::string name = pattern.filename().string();
  if (const auto place = number_place(name))
    name.replace(place->begin, place->end - place->begin, fmt::format("{:0{}}", number, place->digits));
  return pattern.parent_path() / name;
}

Status check_film_path(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".webm" || extension == ".webp") return {};
  if (extension == ".png" && number_place(path.filename().string())) return {};
  return at(path.string(), make_error(ErrorCode::BadInput,
                                      "a recording is exported as .webm or .webp, or as pictures with a "
                                      "number in their name: frames/%04d.png"));
}

Result<std::string> run_film(const ViewOptions& options, const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(auto player, RecordingPlayer::open(options.recording));
  ASSIGN_OR_RETURN(auto device, RenderDevice::open(options.drawing));
  LookChange look = player->look();
  ASSIGN_OR_RETURN(auto renderer, device->make_renderer(*player->asset(), look.look));
  ASSIGN_OR_RETURN(const Film film, open_film(options.film, options));
  const double from_s = options.film_from_s;
  if (from_s > player->length_s())
    return make_error(ErrorCode::BadInput, "--from {:g}: the recording has {:.2f} s", from_s,
                      player->length_s());
  const double end_s = options.film_to_s.value_or(from_s + options.seconds.value_or(player->length_s()));
  const double length_s = std::min(player->length_s(), end_s) - from_s;
  const uint64_t frame_count =
      std::min(kMostFilmFrames, static_cast<uint64_t>(length_s * options.film_fps + 1e-6) + 1);
  Progress progress({"drawing", false, "frame"});
  progress.expect(static_cast<uint32_t>(frame_count), static_cast<double>(frame_count));
  uint64_t drawn = 0;
  for (; drawn < frame_count && !stop; ++drawn) {
    progress.begin_run(options.film.string());
    ASSIGN_OR_RETURN(const PosedStrands strands,
                     player->strands_at(from_s + static_cast<double>(drawn) / options.film_fps));
    if (player->look().look != look.look) RETURN_IF_ERROR(renderer->set_look(player->look().look));
    look = player->look();
    RETURN_IF_ERROR(renderer->draw(strands, look.camera, options.size));
    RETURN_IF_ERROR(film.add(renderer->read_image()));
    progress.end_run(1.0);
  }
  if (drawn == 0) return make_error(ErrorCode::Unavailable, "stopped before the first frame was drawn");
  RETURN_IF_ERROR(film.finish());
  std::string said =
      fmt::format("{} frames of {}x{} at {} fps: {}\n", drawn, options.size.width, options.size.height,
                  frame_rate_text(options.film_fps), options.film.string());
  for (const std::string& remark : player->remarks()) said += "  " + remark + '\n';
  return said;
}

}  // namespace strandcast
