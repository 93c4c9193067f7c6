// Prints CSV: bytes, milliseconds and PSNR of every picture codec and quality on the built-in scene, drawn as
// the server draws it: in motion, and idle (head and wind at rest, the hair swinging out).
//   frame_bench [--pictures N] [--size WxH] [--png DIR]     DIR: the last decoded picture of each mode
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "common/base/profile.h"
#include "common/codec/picture_decoder.h"
#include "common/codec/strand_codec.h"
#include "common/gl/egl_context.h"
#include "common/render/renderer.h"
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
    } else if (word != "--size" ||
               std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2) {
      return make_error(ErrorCode::BadInput,
                        "unknown option {} {} (known: --pictures N --size WxH --png DIR)", word, value);
    }
  }
  return options;
}

/// Pictures of the scene in motion, then after it came to rest.
Result<std::vector<Sequence>> draw(const Options& options) {
  BuiltInScene run(quantum_for_bound(kBoundM));
  ASSIGN_OR_RETURN(const auto context, gl::EglContext::make("auto"));
  ASSIGN_OR_RETURN(auto renderer,
                   Renderer::make(gl::ShaderLibrary(), context->info(), run.asset(), run.scene().look));
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

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double ms_since(int64_t begin_ns) {
  return static_cast<double>(now_ns() - begin_ns) * 1e-6;
}

/// One picture as a viewer that misses nothing gets it.
struct Viewer {
  PictureDecoder decoder;
  uint32_t shown = 0;
  std::vector<double> decode_ms;

  Result<size_t> take(const Picture& picture) {
    const EncodedFramePtr frame = picture.after(std::exchange(shown, picture.sequence()));
    const int64_t begin_ns = now_ns();
    RETURN_IF_ERROR(decoder.decode(frame->header, std::span(frame->message).subspan(kFrameHeaderBytes)));
    decode_ms.push_back(ms_since(begin_ns));
    return frame->message.size();
  }
};

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
    const int64_t begin_ns = now_ns();
    ASSIGN_OR_RETURN(const PicturePtr picture, encoder->encode(sequence.images[i], mode.quality, {}));
    if (i > 0) encode_ms.push_back(ms_since(begin_ns));
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

Status run(int argc, char** argv) {
  ASSIGN_OR_RETURN(const Options options, parse(argc, argv));
  if (!options.png.empty()) std::filesystem::create_directories(options.png);
  ASSIGN_OR_RETURN(const auto sequences, draw(options));
  fmt::print(
      "sequence,codec,quality,size,first_bytes,bytes_per_picture,sent,encode_ms,decode_ms,psnr_db,still_"
      "bytes,"
      "still_psnr_db\n");
  for (const Sequence& sequence : sequences) {
    if (!options.png.empty())
      RETURN_IF_ERROR(
          save_png(options.png / fmt::format("{}_drawn.png", sequence.name), sequence.images.back()));
    for (const int quality : {95, 80, 50, 30})
      for (const Mode& mode :
           {Mode{"jpeg", PictureCodec::Jpeg, quality}, Mode{"tiles", PictureCodec::JpegTiles, quality},
            Mode{"vp8", PictureCodec::Vp8, quality}})
        RETURN_IF_ERROR(measure(options, sequence, mode));
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
