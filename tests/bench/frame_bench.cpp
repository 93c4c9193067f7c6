// Prints CSV: bytes, milliseconds of processor time and PSNR of every picture codec and quality on the
// built-in scene, drawn as the server draws it: in motion, and idle (head and wind at rest, the hair swinging
// out).
//   frame_bench [--pictures N] [--size WxH] [--png DIR] [--renderer NAME]     DIR: the last decoded picture
//   of each mode frame_bench --match yes     instead: bits per pixel with which video in motion looks like
//   tiles of a
//                               quality, at the size and at half of it
//   frame_bench --beside quads  instead: JPEG tiles' bytes of the pictures that the processor draws in tiles
//                               beside those that OpenGL draws as quads, the same strands in motion, for each
//                               quality; with `ratio` of the bytes and how far each is from its picture
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "common/base/quantile.h"
#include "common/pictures/picture_decoder.h"
#include "common/render/render_device.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/strands/strand_codec.h"
#include "server/encode/picture_encoder.h"
#include "tests/bench/scene_run.h"
#include "tests/support/test_pictures.h"

namespace strandcast {
namespace {

constexpr float kBoundM = 1e-4f;
constexpr int kStepsPerPicture = 4;  // 15 Hz
constexpr double kPictureRateHz = 15.0;
constexpr int kWarmUpSteps = 60;
constexpr int kIdleSteps = 600;  // ten seconds to come to rest

struct Options {
  size_t pictures = 30;
  RenderSize size{640, 360};
  std::filesystem::path png;
  std::string renderer = "auto";  // as RenderDeviceConfig
  bool is_matching = false;
  bool is_beside_quads = false;
};

struct Mode {
  const char* name;
  PictureCodec codec;
  int quality;
};

struct Sequence {
  const char* name;
  std::vector<Image> images;
};

Result<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i], value = argv[i + 1];
    if (word == "--pictures") {
      options.pictures = static_cast<size_t>(std::max(2, std::atoi(value.c_str())));
    } else if (word == "--png") {
      options.png = value;
    } else if (word == "--renderer") {
      options.renderer = value;
    } else if (word == "--beside") {
      options.is_beside_quads = value == "quads";
    } else if (word == "--match") {
      options.is_matching = value == "yes";
    } else if (word != "--size" ||
               std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2) {
      return make_error(ErrorCode::BadInput,
                        "unknown option {} {} (known: --pictures N --size WxH --png DIR --match yes --beside "
                        "quads --renderer NAME)",
                        word, value);
    }
  }
  return options;
}

/// Pictures of the scene in motion, then after it came to rest.
Result<std::vector<Sequence>> draw(const Options& options) {
  BuiltInScene run(quantum_for_bound(kBoundM));
  ASSIGN_OR_RETURN(const auto device, RenderDevice::open({options.renderer, "auto", {}}));
  ASSIGN_OR_RETURN(auto renderer, device->make_renderer(run.asset(), run.scene().look));
  const auto take = [&](const char* name) -> Result<Sequence> {
    Sequence sequence{name, {}};
    while (sequence.images.size() < options.pictures) {
      for (int step = 1; step < kStepsPerPicture; ++step) (void)run.next();
      const Snapshot snapshot = run.next();
      RETURN_IF_ERROR(renderer->draw({snapshot.world_from_head, positions_in_head(snapshot)},
                                     run.scene().camera, options.size));
      sequence.images.push_back(renderer->read_image());
    }
    return sequence;
  };
  for (int step = 0; step < kWarmUpSteps; ++step) (void)run.next();
  ASSIGN_OR_RETURN(Sequence moving, take("moving"));
  run.stop_head();
  for (int step = 0; step < kIdleSteps; ++step) (void)run.next();
  ASSIGN_OR_RETURN(Sequence idle, take("idle"));
  return std::vector<Sequence>{std::move(moving), std::move(idle)};
}

/// Processor time of this thread, on which all codecs run: others on the machine do not count.
double busy_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

/// One picture as a viewer that misses nothing gets it.
struct Viewer {
  PictureDecoder decoder;
  uint32_t shown = 0;
  std::vector<double> decode_ms;

  Result<size_t> take(const Picture& picture) {
    const EncodedFramePtr frame = picture.after(std::exchange(shown, picture.sequence()));
    const double begin_ms = busy_ms();
    RETURN_IF_ERROR(decoder.decode(frame->header, std::span(frame->message).subspan(kFrameHeaderBytes)));
    decode_ms.push_back(busy_ms() - begin_ms);
    return frame->message.size();
  }
};

/// Half the size both ways, each pixel the mean of four: what a renderer with four samples draws.
Image halved(const Image& image) {
  Image half{image.width / 2, image.height / 2, {}};
  half.rgba.resize(size_t{half.width} * half.height * 4);
  const auto at = [&](size_t x, size_t y, size_t channel) {
    return static_cast<int>(image.rgba[(y * image.width + x) * 4 + channel]);
  };
  for (size_t y = 0; y < half.height; ++y)
    for (size_t x = 0; x < half.width; ++x)
      for (size_t c = 0; c < 4; ++c)
        half.rgba[(y * half.width + x) * 4 + c] =
            static_cast<uint8_t>((at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c) +
                                  at(2 * x + 1, 2 * y + 1, c) + 2) /
                                 4);
  return half;
}

struct Outcome {
  double bits_per_pixel = 0.0;  // of the pictures after the first
  double psnr_db = 0.0;
};

Outcome mean(const std::vector<Image>& images, size_t bytes, double psnr_sum) {
  const auto later = static_cast<double>(images.size() - 1);
  const double pixels = static_cast<double>(images[0].width) * images[0].height;
  return {8.0 * static_cast<double>(bytes) / later / pixels, psnr_sum / later};
}

Result<Outcome> run_tiles(const std::vector<Image>& images, int quality) {
  PictureView view;
  view.size = {images[0].width, images[0].height};
  view.codec = PictureCodec::JpegTiles;
  ASSIGN_OR_RETURN(const auto encoder, make_picture_encoder(view, kPictureRateHz, 0));
  Viewer viewer;
  size_t bytes = 0;
  double psnr_sum = 0.0;
  for (const Image& image : images) {
    const bool is_first = viewer.shown == 0;
    ASSIGN_OR_RETURN(const PicturePtr picture, encoder->encode(image, quality, {}));
    if (picture != nullptr) {
      ASSIGN_OR_RETURN(const size_t taken, viewer.take(*picture));
      bytes += is_first ? 0 : taken;
    }
    psnr_sum += is_first ? 0.0 : test::psnr(image, *viewer.decoder.image());
  }
  return mean(images, bytes, psnr_sum);
}

Result<Outcome> run_video(PictureCodec codec, const std::vector<Image>& images, double bits_per_pixel) {
  const auto [width, height] = std::pair(images[0].width, images[0].height);
  ASSIGN_OR_RETURN(const auto encoder,
                   make_video_encoder(codec, {width, height, kPictureRateHz,
                                              bits_per_pixel * width * height * kPictureRateHz}));
  ASSIGN_OR_RETURN(const auto decoder, make_video_decoder(codec));
  size_t bytes = 0;
  double psnr_sum = 0.0;
  for (size_t i = 0; i < images.size(); ++i) {
    ASSIGN_OR_RETURN(const auto frame, encoder->encode(images[i], VideoFrame::Delta, VideoRate::Target));
    ASSIGN_OR_RETURN(const Image back, decoder->decode(frame));
    bytes += i == 0 ? 0 : frame.size();
    psnr_sum += i == 0 ? 0.0 : test::psnr(images[i], back);
  }
  return mean(images, bytes, psnr_sum);
}

/// The bits per pixel to ask for, by halving the interval; its upper end when no rate is as good.
Status match_one(PictureCodec codec, const std::vector<Image>& images, int quality) {
  ASSIGN_OR_RETURN(const Outcome tiles, run_tiles(images, quality));
  double low = 0.005, high = 4.0;
  constexpr int kHalvings = 12;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    ASSIGN_OR_RETURN(const Outcome video, run_video(codec, images, middle));
    (video.psnr_db < tiles.psnr_db ? low : high) = middle;
  }
  ASSIGN_OR_RETURN(const Outcome video, run_video(codec, images, high));
  fmt::print("{},{}x{},{},{:.3f},{:.2f},{:.3f},{:.3f},{:.2f}\n", to_string(codec), images[0].width,
             images[0].height, quality, tiles.bits_per_pixel, tiles.psnr_db, high, video.bits_per_pixel,
             video.psnr_db);
  std::fflush(stdout);
  return {};
}

Status match(const Sequence& moving) {
  fmt::print("codec,size,quality,tiles_bits_per_pixel,tiles_psnr_db,target,bits_per_pixel,psnr_db\n");
  std::vector<Image> halves;
  for (const Image& image : moving.images) halves.push_back(halved(image));
  for (const PictureCodec codec : kPictureCodecs) {
    if (!is_video(codec) || (encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    for (const auto* images : {&moving.images, static_cast<const std::vector<Image>*>(&halves)})
      for (const int quality : {95, 90, 80, 50, 30, 10, 1})
        RETURN_IF_ERROR(match_one(codec, *images, quality));
  }
  return {};
}

Status measure(const Options& options, const Sequence& sequence, const Mode& mode) {
  PictureView view;
  view.size = options.size;
  view.codec = mode.codec;
  view.quality = mode.quality;
  ASSIGN_OR_RETURN(const auto encoder, make_picture_encoder(view, kPictureRateHz, 0));
  Viewer viewer;
  std::vector<double> encode_ms;
  size_t first_bytes = 0, bytes = 0, sent = 0;
  double psnr = 0.0;
  for (size_t i = 0; i < sequence.images.size(); ++i) {
    const double begin_ms = busy_ms();
    ASSIGN_OR_RETURN(const PicturePtr picture, encoder->encode(sequence.images[i], mode.quality, {}));
    if (i > 0) encode_ms.push_back(busy_ms() - begin_ms);
    if (picture != nullptr) {
      ASSIGN_OR_RETURN(const size_t taken, viewer.take(*picture));
      (i == 0 ? first_bytes : bytes) += taken;
      sent += i == 0 ? 0 : 1;
    }
    if (i > 0) psnr += test::psnr(sequence.images[i], *viewer.decoder.image());
  }
  const std::string name = fmt::format("{}_{}_{}", sequence.name, mode.name, mode.quality);
  if (!options.png.empty()) RETURN_IF_ERROR(save_png(options.png / (name + ".png"), *viewer.decoder.image()));
  const auto later = static_cast<double>(sequence.images.size() - 1);
  size_t still_bytes = 0;
  ASSIGN_OR_RETURN(const PicturePtr still, encoder->still({}));
  if (still != nullptr) {
    ASSIGN_OR_RETURN(still_bytes, viewer.take(*still));
  }
  const double still_psnr = test::psnr(sequence.images.back(), *viewer.decoder.image());
  if (!options.png.empty())
    RETURN_IF_ERROR(save_png(options.png / (name + "_still.png"), *viewer.decoder.image()));
  fmt::print("{},{},{},{}x{},{},{:.0f},{},{:.2f},{:.2f},{:.2f},{},{:.2f}\n", sequence.name, mode.name,
             mode.quality, options.size.width, options.size.height, first_bytes,
             static_cast<double>(bytes) / later, sent, median(encode_ms), median(viewer.decode_ms),
             psnr / later, still_bytes, still_psnr);
  std::fflush(stdout);
  return {};
}

/// Bytes of whole pictures: which tiles change is the same for both.
Status compare(const std::vector<Image>& tiles, const std::vector<Image>& quads) {
  fmt::print("quality,tiles_bytes,quads_bytes,ratio,tiles_psnr_db,quads_psnr_db\n");
  for (const int quality : {95, 80, 50, 30}) {
    ASSIGN_OR_RETURN(const Outcome ours, run_tiles(tiles, quality));
    ASSIGN_OR_RETURN(const Outcome theirs, run_tiles(quads, quality));
    const double bytes_per_bit = static_cast<double>(tiles[0].width) * tiles[0].height / 8.0;
    fmt::print("{},{:.0f},{:.0f},{:.3f},{:.2f},{:.2f}\n", quality, ours.bits_per_pixel * bytes_per_bit,
               theirs.bits_per_pixel * bytes_per_bit, ours.bits_per_pixel / theirs.bits_per_pixel,
               ours.psnr_db, theirs.psnr_db);
  }
  return {};
}

Status beside_quads(const Options& options) {
  BuiltInScene run(quantum_for_bound(kBoundM));
  ASSIGN_OR_RETURN(const auto context, gl::EglContext::make("auto"));
  const SceneAsset asset = run.asset();
  const LookDesc& look = run.scene().look;
  ASSIGN_OR_RETURN(auto quads,
                   Renderer::make(gl::ShaderLibrary(), context->info(), asset, look, segment_path()));
  ASSIGN_OR_RETURN(auto tiles, make_tile_renderer(asset, look));
  for (int step = 0; step < kWarmUpSteps; ++step) (void)run.next();
  std::vector<Image> images[2];
  while (images[0].size() < options.pictures) {
    for (int step = 1; step < kStepsPerPicture; ++step) (void)run.next();
    const Snapshot snapshot = run.next();
    const PosedStrands strands{snapshot.world_from_head, positions_in_head(snapshot)};
    RETURN_IF_ERROR(tiles->draw(strands, run.scene().camera, options.size));
    images[0].push_back(tiles->read_image());
    RETURN_IF_ERROR(context->make_current());
    RETURN_IF_ERROR(quads->draw(strands, run.scene().camera, options.size));
    images[1].push_back(quads->read_image());
  }
  if (!options.png.empty()) {
    RETURN_IF_ERROR(save_png(options.png / "beside_tiles.png", images[0].back()));
    RETURN_IF_ERROR(save_png(options.png / "beside_quads.png", images[1].back()));
  }
  return compare(images[0], images[1]);
}

Status run(int argc, char** argv) {
  ASSIGN_OR_RETURN(const Options options, parse(argc, argv));
  if (!options.png.empty()) std::filesystem::create_directories(options.png);
  if (options.is_beside_quads) return beside_quads(options);
  ASSIGN_OR_RETURN(const auto sequences, draw(options));
  if (options.is_matching) return match(sequences.front());
  fmt::print(
      "sequence,codec,quality,size,first_bytes,bytes_per_picture,sent,encode_ms,decode_ms,psnr_db,still_"
      "bytes,"
      "still_psnr_db\n");
  for (const Sequence& sequence : sequences) {
    if (!options.png.empty())
      RETURN_IF_ERROR(
          save_png(options.png / fmt::format("{}_drawn.png", sequence.name), sequence.images.back()));
    for (const int quality : {95, 80, 50, 30})
      for (const PictureCodec codec : kPictureCodecs) {
        if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
        RETURN_IF_ERROR(measure(options, sequence, {to_string(codec), codec, quality}));
      }
  }
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const strandcast::Status status = strandcast::run(argc, argv);
  if (!status) std::fprintf(stderr, "%s\n", status.error().to_string().c_str());
  return status ? 0 : 2;
}
