// Messages of a recording besides strands, as domain types: inputs, what each simulation step used of them,
// changes and their authors, and outputs. Layout: proto/RECORDING.md. Decoding checks every field like that
// of control messages. No I/O.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/base/timecode.h"
#include "common/math/pose.h"
#include "common/scene/body_desc.h"
#include "common/scene/scene_file.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr uint32_t kRecordingVersion = 2;
inline constexpr size_t kMaxRecordedSceneBytes = kMaxSceneFileBytes;
inline constexpr size_t kMaxRecordedMessageBytes = kMaxRecordedSceneBytes + (64u << 10);

/// The first message of a recording.
struct RecordingStart {
  uint32_t version = kRecordingVersion;
  std::string server_version;
  std::string sim_device;       // what simulated: "gl", "lanes"; empty = nothing did
  std::string sim_device_name;  // for people
  std::string codec;            // of the recorded strands
  std::string scene_text;       // as the scene was at the start, with absolute paths
  int64_t server_time_ns = 0;   // server clock at the start, which all times below but sim_time_ns go by
  int64_t unix_time_ns = 0;     // the same moment for people
  uint64_t asset_hash = 0;      // hash_bytes of the asset's payload
  std::string slate = {};
  uint32_t take = 0;  // 0 = none
  bool operator==(const RecordingStart&) const = default;
};

/// Names slate and take for people: "slate 12A, take 3"; empty without either.
std::string take_text(const std::string& slate, uint32_t take);

/// A motion or wind message as it was received.
struct RecordedMotion {
  uint64_t source = 0;
  int64_t arrival_ns = 0;
  MotionSamples samples;
  bool operator==(const RecordedMotion&) const = default;
};
struct RecordedWind {
  uint64_t source = 0;
  int64_t arrival_ns = 0;
  WindSamples samples;
  bool operator==(const RecordedWind&) const = default;
};

/// Inputs that one step used. With the scene and its changes, they determine the state at the end of the
/// step.
struct RecordedStep {
  uint64_t tick = 0;
  int64_t time_ns = 0;      // that the end of the step stands for
  double input_rate = 1.0;  // time of the inputs that passed per simulated time
  Pose world_from_head;
  JointPlaces joints = {};
  glm::vec3 wind_mps{0.0f};  // when has_wind_stream
  bool has_motion = false;
  bool has_wind_stream = false;
  bool is_motion_stale = true;
  bool has_teleported = false;
  double motion_speed = 1.0;
  int64_t motion_time_ns = 0;
  uint64_t rejected_samples = 0;
  std::optional<Timecode> timecode = {};
  bool operator==(const RecordedStep&) const = default;
};

/// A command or assignment that was carried out or refused between step `tick` and the next.
struct RecordedChange {
  uint64_t tick = 0;
  std::variant<ControlCommand, SetParameter> what;
  std::string who;  // for people: name, role and address of the session; empty = not known
  Notice answer;
  bool operator==(const RecordedChange&) const = default;
};

/// Change of the lattice of published positions; it applies from the state after step `tick` on.
struct RecordedStream {
  uint64_t tick = 0;
  std::string codec;
  double bound_m = 0.0;
  bool operator==(const RecordedStream&) const = default;
};

/// After step `tick`, strands go on from the state of a keyframe, with the steps since then repeated.
struct RecordedHandOver {
  uint64_t tick = 0;
  uint64_t frame_tick = 0;
  uint32_t frame_sequence = 0;
  bool operator==(const RecordedHandOver&) const = default;
};

/// A published state.
struct RecordedState {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;
  uint64_t state_hash = 0;  // of the published state, before a codec changed it
  std::optional<Timecode> timecode = {};
  bool operator==(const RecordedState&) const = default;
};

/// Camera of one viewer: of a viewer of pictures, or of one that reported its camera.
struct RecordedCamera {
  uint64_t viewer = 0;
  CameraDesc camera;
  bool operator==(const RecordedCamera&) const = default;
};

/// Numbers of messages that could not be written between the preceding and the following one.
struct RecordedLoss {
  uint64_t frames = 0;
  uint64_t messages = 0;
  uint64_t bytes = 0;
  bool operator==(const RecordedLoss&) const = default;
};

using RecordedMessage =
    std::variant<RecordingStart, RecordedMotion, RecordedWind, RecordedStep, RecordedChange, RecordedStream,
                 RecordedState, RecordedCamera, RecordedLoss, LookChange, ServerStatus, RecordedHandOver>;

/// Description of one kind of recorded message, as stored in its channel of the file.
struct RecordedKind {
  const char* topic;             // "/steps"
  const char* schema;            // full name of the channel's protobuf message
  bool has_many_in_one = false;  // that message is a RecordBatch of them
};
/// Returns all kinds, in the order of RecordedMessage's alternatives.
std::span<const RecordedKind> recorded_kinds();
/// Returns a FileDescriptorSet with one of our protobuf messages, given by its full name, and its
/// dependencies.
std::vector<std::byte> message_descriptors(const std::string& schema);

inline constexpr const char* kMediaSchema = "strandcast.v1.MediaMessage";
/// Schema of a RecordBatch of media messages.
inline constexpr const char* kManyMediaSchema = "strandcast.v1.MediaMessages";
/// Wraps a media message (header and payload) into a MediaMessage. decode_media() returns a view into
/// `bytes`.
std::vector<std::byte> encode_media(std::span<const std::byte> message);
Result<std::span<const std::byte>> decode_media(std::span<const std::byte> bytes);

/// Serialises the protobuf message without an opcode; strings are shortened and cleaned as in control
/// messages.
std::vector<std::byte> encode(const RecordedMessage& message);
/// Inverse of encode() for untrusted bytes; `kind` is an index of recorded_kinds().
Result<RecordedMessage> decode_recorded(size_t kind, std::span<const std::byte> bytes);

/// Largest number of messages in a batch and in one chunk of a recording.
inline constexpr size_t kMaxBatchItems = 4096;

struct BatchItem {
  std::span<const std::byte> bytes;  // the message of its kind
  uint32_t order = 0;                // number among all that was recorded
  uint64_t time_ns = 0;              // as the first one's, evenly spread up to the last one's
};

/// Packs several messages of one kind, with their order, into one message of a recording, since a file entry
/// costs more bytes than most messages.
class RecordBatch {
 public:
  bool is_empty() const { return order_steps_.empty(); }
  size_t item_count() const { return order_steps_.size(); }
  size_t size_bytes() const { return items_.size(); }
  uint32_t first_order() const { return first_order_; }
  uint64_t first_time_ns() const { return first_time_ns_; }

  /// Appends a message; `order` and `time_ns` must never decrease.
  void add(std::span<const std::byte> message, uint32_t order, uint64_t time_ns);
  /// Returns the batch as protobuf bytes.
  std::vector<std::byte> encode() const;

 private:
  std::vector<std::byte> items_;       // as they are in the message
  std::vector<uint32_t> order_steps_;  // from the one before; the first is 0
  uint32_t first_order_ = 0;
  uint32_t last_order_ = 0;
  uint64_t first_time_ns_ = 0;
  uint64_t last_time_ns_ = 0;
};

/// Order and time of a batch's first message, as stored beside it in the file.
struct BatchStart {
  uint32_t order = 0;
  uint64_t time_ns = 0;
};
/// Returns the items as views into `bytes`. BadInput if the bytes are not exactly one batch.
Result<std::vector<BatchItem>> read_batch(std::span<const std::byte> bytes, const BatchStart& start);

}  // namespace strandcast
