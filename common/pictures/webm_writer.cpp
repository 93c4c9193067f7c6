// The elements are those of RFC 8794 (EBML) and RFC 9559 (Matroska), by the names that they have there.
#include "common/pictures/webm_writer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "common/base/output_file.h"
#include "common/base/units.h"
#include "common/pictures/video_codec.h"

namespace strandcast {
namespace {

constexpr double kUsualBitsPerPixel = 0.15;
constexpr double kKeyframeS =
    2.0;                          // a keyframe, with which a cluster begins, so often: players seek to these
constexpr size_t kSizeBytes = 8;  // of sizes that are known later

enum Id : uint32_t {
  kEbml = 0x1A45DFA3,
  kEbmlVersion = 0x4286,
  kEbmlReadVersion = 0x42F7,
  kEbmlMaxIdLength = 0x42F2,
  kEbmlMaxSizeLength = 0x42F3,
  kDocType = 0x4282,
  kDocTypeVersion = 0x4287,
  kDocTypeReadVersion = 0x4285,
  kSegment = 0x18538067,
  kInfo = 0x1549A966,
  kTimestampScale = 0x2AD7B1,
  kMuxingApp = 0x4D80,
  kWritingApp = 0x5741,
  kDuration = 0x4489,
  kTracks = 0x1654AE6B,
  kTrackEntry = 0xAE,
  kTrackNumber = 0xD7,
  kTrackUid = 0x73C5,
  kTrackType = 0x83,
  kFlagLacing = 0x9C,
  kCodecId = 0x86,
  kDefaultDuration = 0x23E383,
  kVideo = 0xE0,
  kPixelWidth = 0xB0,
  kPixelHeight = 0xBA,
  kCluster = 0x1F43B675,
  kTimestamp = 0xE7,
  kSimpleBlock = 0xA3,
  kCues = 0x1C53BB6B,
  kCuePoint = 0xBB,
  kCueTime = 0xB3,
  kCueTrackPositions = 0xB7,
  kCueTrack = 0xF7,
  kCueClusterPosition = 0xF1,
};

std::string big_endian(uint64_t value, size_t bytes) {
  std::string text(bytes, '\0');
  for (size_t i = 0; i < bytes; ++i) text[bytes - 1 - i] = static_cast<char>(value >> (8 * i));
  return text;
}
std::string id_bytes(Id id) {
  const auto bytes = static_cast<size_t>((std::bit_width(static_cast<uint32_t>(id)) + 7) / 8);
  return big_endian(id, bytes);
}
/// In eight bytes, whose first bit says so.
std::string size_bytes(uint64_t size) {
  return big_endian(size | 1ull << 56, kSizeBytes);
}
std::string element(Id id, const std::string& content) {
  return id_bytes(id) + size_bytes(content.size()) + content;
}
std::string number(Id id, uint64_t value) {
  return element(id, big_endian(value, 8));
}
std::string real(Id id, double value) {
  return element(id, big_endian(std::bit_cast<uint64_t>(value), 8));
}

struct CuePoint {
  uint64_t time_ms = 0;
  uint64_t cluster_at = 0;  // behind the beginning of the segment's content
};

}  // namespace

struct WebmWriter::State {
  std::optional<OutputFile> file;
  std::unique_ptr<VideoEncoder> encoder;
  double pictures_per_s = 30.0;
  uint64_t picture_count = 0;
  uint64_t segment_at = 0;   // where the segment's content begins
  uint64_t duration_at = 0;  // where the number of Duration stands
  std::string cluster;       // that is being filled
  uint64_t cluster_ms = 0;
  std::vector<CuePoint> cues;

  uint64_t time_ms(uint64_t picture) const {
    return static_cast<uint64_t>(std::llround(static_cast<double>(picture) * kMsPerS / pictures_per_s));
  }
  bool begins_cluster() const {
    const auto every = static_cast<uint64_t>(std::max(1.0, std::round(kKeyframeS * pictures_per_s)));
    return picture_count % every == 0;
  }

  Status begin(const Config& config) {
    RETURN_IF_ERROR(file->append(
        element(kEbml, number(kEbmlVersion, 1) + number(kEbmlReadVersion, 1) + number(kEbmlMaxIdLength, 4) +
                           number(kEbmlMaxSizeLength, 8) + element(kDocType, "webm") +
                           number(kDocTypeVersion, 4) + number(kDocTypeReadVersion, 2))));
    RETURN_IF_ERROR(file->append(id_bytes(kSegment) + size_bytes(0)));
    segment_at = file->size_bytes();
    const std::string info = number(kTimestampScale, kMsInNs) + element(kMuxingApp, "strandcast") +
                             element(kWritingApp, "strandcast") + real(kDuration, 0.0);
    RETURN_IF_ERROR(file->append(element(kInfo, info)));
    duration_at = file->size_bytes() - sizeof(double);
    const auto picture_ns = static_cast<uint64_t>(std::llround(1e9 / pictures_per_s));
    const std::string video = number(kPixelWidth, config.width) + number(kPixelHeight, config.height);
    return file->append(element(
        kTracks, element(kTrackEntry, number(kTrackNumber, 1) + number(kTrackUid, 1) + number(kTrackType, 1) +
                                          number(kFlagLacing, 0) + element(kCodecId, "V_VP8") +
                                          number(kDefaultDuration, picture_ns) + element(kVideo, video))));
  }

  Status write_cluster() {
    if (cluster.empty()) return {};
    cues.push_back({cluster_ms, file->size_bytes() - segment_at});
    const Status written = file->append(element(kCluster, number(kTimestamp, cluster_ms) + cluster));
    cluster.clear();
    return written;
  }

  Status write_end() {
    RETURN_IF_ERROR(write_cluster());
    std::string points;
    for (const CuePoint& cue : cues)
      points +=
          element(kCuePoint, number(kCueTime, cue.time_ms) +
                                 element(kCueTrackPositions,
                                         number(kCueTrack, 1) + number(kCueClusterPosition, cue.cluster_at)));
    RETURN_IF_ERROR(file->append(element(kCues, points)));
    RETURN_IF_ERROR(file->patch(segment_at - kSizeBytes, size_bytes(file->size_bytes() - segment_at)));
    return file->patch(duration_at,
                       big_endian(std::bit_cast<uint64_t>(static_cast<double>(time_ms(picture_count))), 8));
  }
};

WebmWriter::WebmWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
WebmWriter::WebmWriter(WebmWriter&&) noexcept = default;
WebmWriter::~WebmWriter() = default;

Result<WebmWriter> WebmWriter::make(const std::filesystem::path& path, const Config& config) {
  auto state = std::make_unique<State>();
  VideoConfig video{config.width, config.height, config.pictures_per_s, config.bits_per_s};
  if (video.bits_per_s <= 0.0)
    video.bits_per_s = kUsualBitsPerPixel * config.width * config.height * config.pictures_per_s;
  ASSIGN_OR_RETURN(state->encoder, make_video_encoder(PictureCodec::Vp8, video));
  state->pictures_per_s = config.pictures_per_s;
  ASSIGN_OR_RETURN(OutputFile file, OutputFile::create(path));
  state->file.emplace(std::move(file));
  RETURN_IF_ERROR(state->begin(config));
  return WebmWriter(std::move(state));
}

Status WebmWriter::add(const Image& image) {
  State& state = *state_;
  const uint64_t time_ms = state.time_ms(state.picture_count);
  const bool is_first = state.begins_cluster();
  if (is_first) {
    RETURN_IF_ERROR(state.write_cluster());
    state.cluster_ms = time_ms;
  }
  ASSIGN_OR_RETURN(
      const std::vector<std::byte> frame,
      state.encoder->encode(image, is_first ? VideoFrame::Keyframe : VideoFrame::Delta, VideoRate::Target));
  constexpr char kTrack = '\x81', kIsKeyframe = '\x80';
  std::string block(1, kTrack);
  block += big_endian(time_ms - state.cluster_ms, 2);
  block += is_first ? kIsKeyframe : '\0';
  block.append(reinterpret_cast<const char*>(frame.data()), frame.size());
  state.cluster += element(kSimpleBlock, block);
  ++state.picture_count;
  return {};
}

Status WebmWriter::finish() {
  RETURN_IF_ERROR(state_->write_end());
  return state_->file->finish();
}

}  // namespace strandcast
