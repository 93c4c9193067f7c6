#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/pictures/image_check.h"

namespace strandcast {
namespace {

constexpr float kClipQuality = 80.0f;
constexpr int kClipMethod = 2;  // 0 fast .. 6 small
constexpr int kClipChannels = 4;
constexpr double kMinPicturesPerS = 0.1;
constexpr double kMaxPicturesPerS = 1000.0;

struct FreeEncoder {
  void operator()(WebPAnimEncoder* encoder) const { WebPAnimEncoderDelete(encoder); }
};

/// A WebPPicture that frees its planes.
struct Picture {
  WebPPicture picture;
  Picture() { CHECK(WebPPictureInit(&picture)); }
  ~Picture() { WebPPictureFree(&picture); }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;
};

}  // namespace

struct ClipWriter::State {
  std::filesystem::path path;
  double picture_ms = 0.0;
  uint64_t pictures = 0;
  uint32_t width = 0;
  uint32_t height = 0;
  bool is_finished = false;
  std::unique_ptr<WebPAnimEncoder, FreeEncoder> encoder;

  int timestamp_ms() const {
    return static_cast<int>(std::lround(static_cast<double>(pictures) * picture_ms));
  }
};

ClipWriter::ClipWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ClipWriter::ClipWriter(ClipWriter&&) noexcept = default;
ClipWriter& ClipWriter::operator=(ClipWriter&&) noexcept = default;
ClipWriter::~ClipWriter() = default;

Result<ClipWriter> ClipWriter::make(const std::filesystem::path& path, double pictures_per_s) {
  if (!(pictures_per_s >= kMinPicturesPerS && pictures_per_s <= kMaxPicturesPerS))
    return at(path.string(), make_error(ErrorCode::BadInput, "clip rate {} Hz is not in {}..{}",
                                        pictures_per_s, kMinPicturesPerS, kMaxPicturesPerS));
  auto state = std::make_unique<State>();
  state->path = path;
  state->picture_ms = 1000.0 / pictures_per_s;
  return ClipWriter(std::move(state));
}

Status ClipWriter::add(const Image& image) {
  State& state = *state_;
  if (auto valid = check_image(image); !valid) return at(state.path.string(), valid.error());
  if (!state.encoder) {
    WebPAnimEncoderOptions options;
    CHECK(WebPAnimEncoderOptionsInit(&options));
    state.width = image.width;
    state.height = image.height;
    state.encoder.reset(
        WebPAnimEncoderNew(static_cast<int>(image.width), static_cast<int>(image.height), &options));
    if (!state.encoder)
      return at(state.path.string(), make_error(ErrorCode::Internal, "cannot start the WebP encoder"));
  }
  if (image.width != state.width || image.height != state.height)
    return at(state.path.string(),
              make_error(ErrorCode::BadInput, "picture {} has {} x {} pixels, the clip {} x {}",
                         state.pictures, image.width, image.height, state.width, state.height));
  WebPConfig config;
  CHECK(WebPConfigPreset(&config, WEBP_PRESET_PICTURE, kClipQuality));
  config.method = kClipMethod;
  Picture frame;
  frame.picture.use_argb = 1;
  frame.picture.width = static_cast<int>(image.width);
  frame.picture.height = static_cast<int>(image.height);
  const bool is_added =
      WebPPictureImportRGBA(&frame.picture, image.rgba.data(),
                            static_cast<int>(image.width) * kClipChannels) &&
      WebPAnimEncoderAdd(state.encoder.get(), &frame.picture, state.timestamp_ms(), &config);
  if (!is_added)
    return at(state.path.string(), make_error(ErrorCode::Internal, "cannot encode picture {} ({})",
                                              state.pictures, WebPAnimEncoderGetError(state.encoder.get())));
  ++state.pictures;
  return {};
}

Status ClipWriter::finish() {
  State& state = *state_;
  if (state.is_finished)
    return at(state.path.string(), make_error(ErrorCode::Internal, "clip is already written"));
  state.is_finished = true;
  if (state.pictures == 0)
    return at(state.path.string(), make_error(ErrorCode::BadInput, "the clip has no pictures"));
  WebPData data;
  WebPDataInit(&data);
  // A last empty picture gives the one before it its duration.
  const bool is_assembled = WebPAnimEncoderAdd(state.encoder.get(), nullptr, state.timestamp_ms(), nullptr) &&
                            WebPAnimEncoderAssemble(state.encoder.get(), &data);
  Status status;
  if (is_assembled)
    status = save_file(state.path, std::as_bytes(std::span(data.bytes, data.size)));
  else
    status = at(state.path.string(), make_error(ErrorCode::Internal, "cannot assemble the clip ({})",
                                                WebPAnimEncoderGetError(state.encoder.get())));
  WebPDataClear(&data);
  return status;
}

}  // namespace strandcast
