// LiveSource: one live input without its socket. It chooses the sender, parses its bytes, selects the subject
// that drives the head, applies the policy and counts all of this. No clock, no I/O; one thread at a time.
//
// * The first address and port that sends a pose or wind is the sender, until nothing readable came from it
//   for kMotionStaleNs. Meanwhile packets of others are refused unread.
// * Wishes to record come from all who may send.
// * At most kMaxSampleRateHz packets (input_hub.h) and kMaxLiveBytesPerS are read.
// * The head is driven by the chosen subject. Without a choice it is a subject without a name or called head
//   (in any case), else the first one seen, while it stays visible.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/live_desc.h"
#include "common/wire/messages.h"
#include "server/input/live/live_parser.h"
#include "server/input/live/live_policy.h"

namespace strandcast {

inline constexpr double kMaxLiveBytesPerS = 2e6;
inline constexpr size_t kMaxLiveSubjects = 32;
inline constexpr int64_t kRateWindowNs = 1'000'000'000;
/// Wishes to record go on one by one with this pause.
inline constexpr int64_t kRecordPauseNs = 250'000'000;
inline constexpr size_t kMaxWaitingRecordings = 2;  // further ones are dropped

struct LiveSourceCounters {
  uint64_t packets = 0;  // that could be read
  uint64_t received_bytes = 0;
  uint64_t malformed = 0;
  uint64_t refused = 0;  // of others, while one is heard, or of who may not send
  uint64_t over_rate = 0;
};

/// What a note is about: however often one kind comes, the log has room for the others.
enum class LiveNoteKind { Sender, Other, Malformed, Subject, Found, Recording, Connection };

/// A note for the log, written once.
struct LiveNote {
  bool is_warning = false;
  std::string text;
  LiveNoteKind kind = LiveNoteKind::Sender;
};

class LiveSource {
 public:
  /// Makes a source; NotFound and BadInput name the field of `live.N`.
  static Result<std::unique_ptr<LiveSource>> make(const LiveDesc& live, size_t index);

  const LiveProtocol& protocol() const { return protocol_; }
  const LiveDesc& live() const { return live_; }
  uint16_t port() const { return port_; }
  /// Describes the source: "vmc, port 39539" or "vrpn, HOST:3883".
  std::string describe() const;

  /// Takes the bytes of one datagram, or as read from a connection. An error ends that connection.
  Status take(const std::string& sender, std::span<const std::byte> bytes, int64_t arrival_ns);
  /// Counts a packet from an address that may not send.
  void refuse() { ++counters_.refused; }
  /// Resets the parser, because a connection begins or has ended.
  void begin_connection();
  std::vector<std::byte> greeting() const { return parser_->greeting(); }
  std::vector<std::byte> request() const { return parser_->request(); }

  /// Output of advance(); call that after take() and every few milliseconds.
  struct Due {
    std::vector<MotionSamples> motion;  // at most one sample each; times are the server's
    std::vector<WindSamples> wind;
    std::optional<RecordCommand> recording;  // to begin or to end
    bool has_ended = false;                  // the head has become stale: who drives it may be another one
  };
  Due advance(int64_t now_ns);
  /// Returns whether advance() has work although nothing was received.
  bool is_active() const { return was_heard_ || !was_stale_ || !recordings_.empty(); }

  void choose_subject(const std::string& subject);
  bool has_seen(const std::string& subject) const;
  /// Makes the present pose the head at rest; returns false if the subject is not seen.
  bool calibrate(int64_t now_ns) { return policy_.calibrate(now_ns); }
  void reset_calibration() { policy_.reset_calibration(); }
  bool is_stale(int64_t now_ns) const { return policy_.is_stale(now_ns); }

  LiveInputStatus status(int64_t now_ns) const;
  std::vector<LiveNote> take_notes() { return std::exchange(notes_, {}); }

 private:
  struct Subject {
    std::string name;
    int64_t seen_ns = 0;
    std::optional<uint64_t> body;
  };

  LiveSource(const LiveDesc& live, const LiveProtocol& protocol, LiveParserConfig parser);
  bool is_heard(int64_t now_ns) const;
  bool take_allowance(size_t bytes, int64_t arrival_ns);
  void hear(const std::string& sender, int64_t arrival_ns);
  void note_silence();
  void note_malformed(const std::string& sender, std::span<const std::byte> bytes, const Error& error);
  void note_unbelieved(int64_t now_ns);
  uint64_t refused_poses() const;
  void warn(const std::string& text);
  void measure(int64_t arrival_ns);
  void rename_subject(const LivePose& pose, const std::string& name, const std::vector<std::string>& names);
  void note_subject(const std::string& name, int64_t arrival_ns);
  void follow_subject(int64_t now_ns);
  void use(const LivePacket& packet, int64_t arrival_ns);
  void wish(const LiveTake& take);
  bool is_namesake(const LivePose& pose, const LivePose& taken);
  void move_head(const LivePose& pose, int64_t arrival_ns);

  LiveDesc live_;
  const LiveProtocol& protocol_;
  const uint16_t port_;
  const LiveParserConfig parser_config_;
  std::unique_ptr<LiveParser> parser_;
  LivePolicy policy_;
  LiveSourceCounters counters_;
  std::vector<LiveNote> notes_;

  std::string sender_;        // that is heard, or was
  std::string other_sender_;  // refused last
  bool is_locked_ = false;    // to it
  bool was_heard_ = false;    // when last looked at
  bool was_stale_ = true;
  bool has_told_impossible_ = false;  // of this sender
  bool has_told_namesakes_ = false;
  bool has_told_unbelieved_ = false;
  uint64_t offered_ = 0;                // poses to the policy, in a window of kMotionStaleNs
  uint64_t refused_before_ = 0;         // of all poses, when the window began
  int64_t offered_ns_ = 0;              // when that was
  int64_t refused_ns_ = INT64_MIN / 2;  // when a pose was not believed last
  int64_t packet_ns_ = 0;               // arrival of the newest that could be read
  double packet_allowance_ = 0.0, byte_allowance_ = 0.0;
  int64_t allowance_ns_ = 0;

  std::vector<Subject> subjects_;          // in the order in which they were seen
  std::optional<std::string> subject_;     // that drives the head
  std::vector<WindSamples> wind_;          // not given out yet
  std::vector<RecordCommand> recordings_;  // likewise
  int64_t recorded_ns_ = INT64_MIN / 2;    // when one was given out

  int64_t window_begin_ns_ = 0;  // of the rate
  uint32_t window_packets_ = 0;
  double rate_hz_ = 0.0, jitter_ms_ = 0.0, interval_ms_ = 0.0;
};

}  // namespace strandcast
