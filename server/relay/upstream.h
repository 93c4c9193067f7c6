// Upstream: what a relay gets of one head of the server that it stands in for, for all of its viewers: the
// streams of strands that they need, each with its chain for those who join, and what all are told. Any
// thread; nothing waits for the network.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/net/net_server.h"
#include "server/relay/frame_chain.h"
#include "server/relay/upstream_link.h"

namespace strandcast {

/// A stream that nobody needs any more is kept for so long.
inline constexpr int64_t kUnneededStreamNs = 10'000'000'000;
/// Keyframes of one stream are asked for at most once in this time.
inline constexpr int64_t kKeyframeAskNs = 1'000'000'000;
/// What there is to relay, since the server above was started.
struct Relayed {
  Welcome welcome;  // of class 0, with the newest look
  EncodedFramePtr asset;
  StreamList streams;
};
using RelayedPtr = std::shared_ptr<const Relayed>;

/// Totals since start.
struct UpstreamCounters {
  uint64_t streams = 0;  // now
  uint64_t keyframes_asked = 0;
  uint64_t joins_from_chain = 0;
  uint64_t reconnects = 0;  // of class 0
  uint64_t received_bytes = 0;
  uint64_t frames = 0;  // of strands, keyframes too
  uint64_t keyframes = 0;

  UpstreamCounters& operator+=(const UpstreamCounters& other);
};

class Upstream {
 public:
  struct Hooks {
    std::function<void(RelayedPtr)> on_relayed;          // what there is now
    std::function<void(const CameraChange&)> on_camera;  // where all viewers are to look from
    /// The heads that there are, before a viewer is let in; under this one's lock.
    std::function<void(const std::vector<std::string>&)> on_heads;
  };
  /// `id`: the relay's own; `number`: of the head that its viewers have joined.
  Upstream(UpstreamConfig config, std::string id, size_t number)
      : config_(std::move(config)), id_(std::move(id)), number_(number) {}
  /// stop(), if it was not called.
  ~Upstream() { stop(); }
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  /// Before follow(). `net` outlives stop().
  void connect(NetServer& net, Hooks hooks);
  /// Gets the head of this name there from now on, the first for an empty one: tries to connect, again and
  /// again.
  void follow(const std::string& head);
  /// Stops getting anything; viewers that are there are sent away.
  void rest();
  /// Not on the network thread.
  void stop();

  /// Streams that viewers need now.
  void set_demand(std::set<uint16_t> streams);
  /// Sends the session the chain of a stream, or asks for a keyframe.
  void join(SessionId session, uint16_t stream_id);
  void request_keyframe(uint16_t stream_id);

  /// The newest status; an empty one before the first.
  ServerStatus status() const;
  UpstreamCounters counters() const;
  /// What is followed, as follow() had it.
  std::string head() const;
  /// Whether viewers can be let in, or why not.
  Status connected() const;
  /// Whether connected() holds and frames come, where any are wanted.
  Status readiness() const;
  /// Why it gave up; nothing while all is well.
  std::optional<Error> failure() const;
  std::string server() const { return config_.address.to_string(); }

 private:
  /// A stream, and which of its links, one after another.
  struct StreamKey {
    uint16_t stream_id = 0;
    uint64_t number = 0;
  };
  struct Stream {
    uint64_t number = 0;
    std::unique_ptr<UpstreamLink> link;
    std::string server_id;  // session_id that its server said
    FrameChain chain;
    int64_t needed_ns = 0;  // the last time that it was
    int64_t asked_ns = 0;   // for a keyframe
  };
  using Links = std::vector<std::unique_ptr<UpstreamLink>>;

  Stream* find(const StreamKey& key);
  Hello hello_for(uint16_t stream_id) const;
  void open_stream(uint16_t stream_id);
  Status on_welcome(const StreamKey& key, const Welcome& welcome);
  Status check_way(const Welcome& welcome) const;
  void on_event(const StreamKey& key, ClientEvent event);
  void on_frame(Stream& stream, MediaEvent media);
  bool on_lost(const StreamKey& key, const Error& error);
  void on_silence(const StreamKey& key, bool is_silent);
  void tell_away(const Error& error, int64_t since_ns);
  void tell_back();
  void repeat_away(int64_t time_ns);
  void on_first_event(ClientEvent event);
  void take_list(const StreamList& list);
  bool is_another() const;
  void begin_if_complete();
  void begin_anew(const char* reason);
  void leave_server();
  void tell_relayed();
  void ask(Stream& stream);
  bool is_of_now(const Stream& stream) const;
  template <class IsOver>
  void end_streams(IsOver is_over);
  void run();
  void follow_demand(int64_t time_ns);
  void look_for_list(int64_t time_ns);
  void follow_clock();

  const UpstreamConfig config_;
  const std::string id_;
  const size_t number_;
  NetServer* net_ = nullptr;
  Hooks hooks_;

  mutable std::mutex mutex_;  // guards all below; never held while a link ends
  std::condition_variable changed_;
  bool is_stopping_ = false;
  std::optional<std::string> head_;  // nothing: it rests
  bool is_connected_ = false;        // class 0
  int64_t away_since_ns_ = 0;        // viewers were told that the server is away; 0: it is there
  int64_t away_told_ns_ = 0;         // the last time
  std::optional<Error> trouble_;
  std::optional<Error> failure_;
  Relayed next_;        // as far as it has come
  RelayedPtr relayed_;  // null before the first
  ServerStatus status_;
  int64_t newest_frame_ns_ = 0;
  int64_t welcome_ns_ = 0;  // of class 0
  uint64_t next_number_ = 0;
  int64_t clock_offset_ns_ = 0;
  std::set<uint16_t> demand_;
  std::map<uint16_t, Stream> streams_;
  Links ended_;  // to be waited for
  UpstreamCounters counters_;
  std::thread thread_;
};

}  // namespace strandcast
