// OpenTrackIO 1.0 of cameras and heads, as JSON or CBOR. A head is where the chain of `transforms` leads,
// each within the one before; a subject is a source's number. Axes are `pan-left` or `pan-right`. Times are
// `sampleTimestamp`, else the number of the sample over its rate. Segments of a sample are put together in
// order; where one is missing or another sample begins, it is dropped and counted as ignored.
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>

#include "common/base/text.h"
#include "common/base/units.h"
#include "common/motion/opentrackio.h"
#include "server/input/live/conventions.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kMaxShownTextChars = 60;
constexpr uint32_t kMostPoseless = 120;  // samples on end, until that is said

/// The value at a path of keys; null where there is none.
const ValueTree* find_at(const ValueTree& tree, std::initializer_list<std::string_view> path) {
  const ValueTree* found = &tree;
  for (const std::string_view key : path)
    if (found != nullptr) found = found->find(key);
  return found;
}
std::optional<double> number_at(const ValueTree& tree, std::initializer_list<std::string_view> path) {
  const ValueTree* found = find_at(tree, path);
  return found == nullptr ? std::nullopt : found->number();
}
std::string text_at(const ValueTree& tree, std::initializer_list<std::string_view> path) {
  const ValueTree* found = find_at(tree, path);
  return found == nullptr || found->text() == nullptr ? std::string()
                                                      : one_line(*found->text(), kMaxShownTextChars);
}
/// What is missing in a triple is no number, so that the pose is refused.
glm::dvec3 triple_of(const ValueTree& tree, const std::array<const char*, 3>& keys) {
  glm::dvec3 triple(std::numeric_limits<double>::quiet_NaN());
  for (int i = 0; i < 3; ++i)
    if (const auto number = number_at(tree, {keys[static_cast<size_t>(i)]})) triple[i] = *number;
  return triple;
}
/// What a sample says, in its own units.
struct TrackFields {
  std::optional<TrackPose> pose;  // of the last transform within the one before
  Pose world_from_subject;
  bool has_position = false;
  std::string subject;
  std::optional<uint32_t> number;
  std::optional<double> time_s;  // of the sampleTimestamp
  std::optional<double> rate_hz;
  std::optional<Timecode> timecode;
  std::optional<bool> is_recording;
  std::string slate, status;
  std::string synchronized_to;  // ptp, genlock, ..; empty = not told
  bool is_locked = false;       // to that
};

/// A whole number that fits; empty for any other.
std::optional<uint32_t> count_at(const ValueTree& tree, std::initializer_list<std::string_view> path) {
  const auto number = number_at(tree, path);
  if (!number || !(*number >= 0.0 && *number <= std::numeric_limits<uint32_t>::max()) ||
      *number != std::floor(*number))
    return std::nullopt;
  return static_cast<uint32_t>(*number);
}
std::optional<FrameRate> rate_at(const ValueTree& tree, std::initializer_list<std::string_view> path) {
  const ValueTree* found = find_at(tree, path);
  if (found == nullptr) return std::nullopt;
  const auto above = count_at(*found, {"num"}), below = count_at(*found, {"denom"});
  if (above.value_or(0) == 0 || below.value_or(0) == 0) return std::nullopt;
  const uint32_t common = std::gcd(*above, *below);
  return FrameRate{*above / common, *below / common};
}

/// Of a rate of its own, else of the samples; empty for what is no timecode.
std::optional<Timecode> timecode_of(const ValueTree& tree) {
  const ValueTree* told = find_at(tree, {"timing", "timecode"});
  auto rate = rate_at(tree, {"timing", "timecode", "frameRate"});
  if (!rate) rate = rate_at(tree, {"timing", "timecode", "format", "frameRate"});  // before version 1.0
  if (!rate) rate = rate_at(tree, {"timing", "sampleRate"});
  if (told == nullptr || !rate) return std::nullopt;
  const auto hours = count_at(*told, {"hours"}), minutes = count_at(*told, {"minutes"});
  const auto seconds = count_at(*told, {"seconds"}), frames = count_at(*told, {"frames"});
  if (!hours || !minutes || !seconds || !frames) return std::nullopt;
  const ValueTree* drop = told->find("dropFrame");
  const auto timecode = make_timecode({*hours, *minutes, *seconds, *frames}, *rate,
                                      drop != nullptr && drop->truth().value_or(false));
  return timecode ? std::optional(*timecode) : std::nullopt;
}

class OpenTrackIoParser : public LiveParser {
 public:
  explicit OpenTrackIoParser(double pan_sign) : pan_sign_(pan_sign) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    ASSIGN_OR_RETURN(const TrackSegment segment, read_track_segment(bytes));
    const bool is_known = segment.encoding == static_cast<uint8_t>(TrackEncoding::Json) ||
                          segment.encoding == static_cast<uint8_t>(TrackEncoding::Cbor);
    if (!is_known && segment.encoding < kFirstVendorEncoding)
      return make_error(ErrorCode::BadInput, "OpenTrackIO has JSON (1) and CBOR (2), no encoding {}",
                        segment.encoding);
    if (!is_known) {
      ++ignored_;
      return LivePacket{};
    }
    if (segment.offset == 0 && segment.is_last) return parse_whole(segment.encoding, segment.payload);
    return parse_segment(segment);
  }

  uint64_t ignored() const override { return ignored_; }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

  std::vector<std::string> describe() const override {
    if (!last_) return {};
    MonitorLines lines;
    const TrackFields& fields = *last_;
    lines.add(fields.subject.empty() ? "source without a number" : fmt::format("source {}", fields.subject));
    if (fields.pose) {
      const glm::dvec3& p = fields.pose->translation_m;
      lines.add(fmt::format("pan {:.3f} tilt {:.3f} roll {:.3f} degrees", fields.pose->pan_deg,
                            fields.pose->tilt_deg, fields.pose->roll_deg));
      lines.add(fmt::format("x {:.4f} y {:.4f} z {:.4f} m", p.x, p.y, p.z));
    }
    if (fields.number) lines.add(fmt::format("sample {}", *fields.number));
    if (fields.rate_hz) lines.add(fmt::format("{:.3f} samples a second", *fields.rate_hz));
    if (fields.timecode) lines.add("timecode " + timecode_text(*fields.timecode));
    if (fields.is_recording) lines.add(*fields.is_recording ? "records" : "does not record");
    if (!fields.slate.empty()) lines.add("slate " + fields.slate);
    if (!fields.status.empty()) lines.add("status " + fields.status);
    if (!fields.synchronized_to.empty())
      lines.add((fields.is_locked ? "locked to " : "not locked to ") + fields.synchronized_to);
    return std::move(lines).take();
  }

 private:
  /// A sample whose segments come in.
  struct Pending {
    uint8_t encoding = 0;
    uint16_t sequence = 0;  // of the newest segment
    std::vector<std::byte> bytes;
  };

  /// An error leaves what came before as it was.
  Result<LivePacket> parse_segment(const TrackSegment& segment) {
    Pending pending = pending_;
    const auto passed = static_cast<uint16_t>(segment.sequence - pending.sequence);
    // Senders number segments, or samples.
    const bool goes_on = !pending.bytes.empty() && pending.encoding == segment.encoding && passed <= 1;
    if (goes_on && passed == 0 && segment.offset < pending.bytes.size())
      return LivePacket{};  // it came twice
    if (segment.offset != 0 && !(goes_on && segment.offset == pending.bytes.size())) {
      drop_pending();
      ++ignored_;
      return LivePacket{};
    }
    if (segment.offset == 0) pending.bytes.clear();
    if (pending.bytes.size() + segment.payload.size() > kMaxTrackSampleBytes)
      return make_error(ErrorCode::LimitExceeded, "a sample of OpenTrackIO has more than {} bytes",
                        kMaxTrackSampleBytes);
    pending.encoding = segment.encoding;
    pending.sequence = segment.sequence;
    pending.bytes.insert(pending.bytes.end(), segment.payload.begin(), segment.payload.end());
    LivePacket packet;
    if (segment.is_last) {
      ASSIGN_OR_RETURN(packet, read_sample(pending.encoding, pending.bytes));
      pending.bytes.clear();
    } else if (segment.offset == 0) {
      drop_pending();
    }
    pending_ = std::move(pending);
    return packet;
  }

  Result<LivePacket> parse_whole(uint8_t encoding, std::span<const std::byte> payload) {
    ASSIGN_OR_RETURN(LivePacket packet, read_sample(encoding, payload));
    drop_pending();
    return packet;
  }

  void drop_pending() {
    if (!pending_.bytes.empty()) ++ignored_;
    pending_.bytes.clear();
  }

  Result<LivePacket> read_sample(uint8_t encoding, std::span<const std::byte> payload) {
    const std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
    const bool is_json = encoding == static_cast<uint8_t>(TrackEncoding::Json);
    auto tree = is_json ? read_json(text) : read_cbor(payload);
    if (!tree) return at(is_json ? "OpenTrackIO in JSON" : "OpenTrackIO in CBOR", tree.error());
    TrackFields fields = read_fields(*tree);
    LivePacket packet;
    packet.take = take_of(fields);
    note_lock(fields);
    if (fields.pose) packet.poses.push_back(pose_of(fields));
    if (!fields.pose) ++ignored_;  // of a lens or a clock alone
    poseless_ = fields.pose ? 0 : poseless_ + 1;
    if (poseless_ == kMostPoseless)
      notes_.push_back(fmt::format("{} samples on end have no transforms: no head is moved", kMostPoseless));
    last_ = std::move(fields);
    return packet;
  }

  TrackFields read_fields(const ValueTree& tree) const {
    TrackFields fields;
    if (const auto number = count_at(tree, {"sourceNumber"})) fields.subject = fmt::format("{}", *number);
    fields.number = count_at(tree, {"timing", "sequenceNumber"});
    const auto seconds = number_at(tree, {"timing", "sampleTimestamp", "seconds"});
    if (seconds)
      fields.time_s =
          *seconds + number_at(tree, {"timing", "sampleTimestamp", "nanoseconds"}).value_or(0.0) * kSPerNs;
    if (const auto rate = rate_at(tree, {"timing", "sampleRate"})) fields.rate_hz = rate->hz();
    if (const ValueTree* recording = find_at(tree, {"tracker", "recording"}))
      fields.is_recording = recording->truth();
    fields.slate = text_at(tree, {"tracker", "slate"});
    fields.status = text_at(tree, {"tracker", "status"});
    fields.timecode = timecode_of(tree);
    fields.synchronized_to = text_at(tree, {"timing", "synchronization", "source"});
    if (const ValueTree* locked = find_at(tree, {"timing", "synchronization", "locked"}))
      fields.is_locked = locked->truth().value_or(false);
    read_transforms(tree, fields);
    return fields;
  }

  void read_transforms(const ValueTree& tree, TrackFields& fields) const {
    const ValueTree* transforms = tree.find("transforms");
    if (transforms == nullptr || transforms->list() == nullptr) return;
    glm::dvec3 scale(1.0);
    for (const ValueTree& transform : *transforms->list()) {
      TrackPose pose;
      if (const ValueTree* translation = transform.find("translation")) {
        pose.translation_m = triple_of(*translation, {"x", "y", "z"});
        fields.has_position = true;
      }
      if (const ValueTree* rotation = transform.find("rotation")) {
        const glm::dvec3 turn = triple_of(*rotation, {"pan", "tilt", "roll"});
        pose.pan_deg = turn.x;
        pose.tilt_deg = turn.y;
        pose.roll_deg = turn.z;
      }
      fields.pose = pose;
      pose.translation_m *= scale;
      pose.pan_deg *= pan_sign_;
      const Pose local = pose_from_track(pose);
      Pose& world = fields.world_from_subject;
      world = {world * local.position_m, world.rotation * local.rotation};
      if (const ValueTree* more = transform.find("scale")) scale *= triple_of(*more, {"x", "y", "z"});
    }
  }

  LivePose pose_of(const TrackFields& fields) {
    LivePose pose;
    pose.subject = fields.subject;
    pose.world_from_subject = fields.world_from_subject;
    pose.has_position = fields.has_position;
    if (fields.number) pose.frame = numbers_.unwrapped(*fields.number);
    pose.timecode = fields.timecode;
    if (fields.time_s)
      pose.source_time_ns = nanoseconds_of(*fields.time_s);
    else if (pose.frame && fields.rate_hz)
      pose.source_time_ns = nanoseconds_of(static_cast<double>(*pose.frame) / *fields.rate_hz);
    return pose;
  }

  /// Says where a tracker's clock runs free, and where it no longer does.
  void note_lock(const TrackFields& fields) {
    if (fields.synchronized_to.empty()) return;
    if (fields.is_locked != is_locked_)
      notes_.push_back(fmt::format("the tracker is {} to {}",
                                   fields.is_locked ? "locked again" : "not locked", fields.synchronized_to));
    is_locked_ = fields.is_locked;
  }

  /// What the tracker's flag asks for where it changes. A sample without the flag leaves it as it was.
  std::optional<LiveTake> take_of(TrackFields& fields) const {
    const bool was_recording = last_ && last_->is_recording.value_or(false);
    if (!fields.is_recording && last_) fields.is_recording = last_->is_recording;
    const bool is_recording = fields.is_recording.value_or(false);
    if (was_recording == is_recording) return std::nullopt;
    return LiveTake{is_recording, is_recording ? fields.slate : std::string(), 0};
  }

  const double pan_sign_;
  Pending pending_;
  std::optional<TrackFields> last_;
  WrappingCount numbers_;  // of samples
  bool is_locked_ = true;  // what was said last
  uint32_t poseless_ = 0;  // samples on end
  std::vector<std::string> notes_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_opentrackio_parser(size_t axis_order) {
  return std::make_unique<OpenTrackIoParser>(axis_order == 0 ? 1.0 : -1.0);
}

}  // namespace strandcast
