// HeadSender: sends a head's pose to other programs with every state, as packets of motion capture protocols,
// so that they follow the head. A reader of the stream; it never waits, and what the network does not take at
// once is lost.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/client/address.h"
#include "common/client/datagram_sender.h"
#include "common/motion/mocap_packet.h"
#include "server/app/stage_clock.h"
#include "server/stream/stream_reader.h"

namespace strandcast {

/// A program that follows the heads.
struct HeadSend {
  std::string protocol;  // a name of find_mocap_encoding()
  Address to;

  bool operator==(const HeadSend&) const = default;
};

/// Parses PROTOCOL, PROTOCOL:PORT or PROTOCOL://HOST[:PORT]; what names no host is this machine. BadInput
/// explains the accepted forms, or lists the protocols.
Result<HeadSend> parse_head_send(const std::string& text);

/// Returns an error where what is sent comes back into a live input of this machine.
Status check_sends(const std::vector<HeadSend>& sends, const SceneDesc& scene);

/// What else goes with a state.
struct HeadTold {
  std::optional<glm::vec3> wind_mps;  // at the head, world
  std::optional<bool> is_recording;   // empty: nothing can be recorded
  std::string slate;                  // of the recording, with its take; empty = none
};

struct HeadSenderConfig {
  uint32_t head = 0;  // its number: protocols that do not number their sources carry the first head alone
  double rate_hz = 0.0;
  StageClock clock = {};                // that times are told by
  std::function<HeadTold()> tell = {};  // called with every state; may be empty
};

class HeadSender : public StreamReader {
 public:
  /// Opens the sockets; NotFound for an unknown host.
  static Result<std::unique_ptr<HeadSender>> open(const std::vector<HeadSend>& sends,
                                                  HeadSenderConfig config);

  void on_state(const std::shared_ptr<const Snapshot>& state) override;

  bool is_empty() const { return ways_.empty(); }
  /// Returns the packets that the network did not take. Any thread.
  uint64_t unsent() const { return unsent_; }

 private:
  struct Way {
    MocapEncoding encoding;
    std::unique_ptr<DatagramSender> sender;
  };
  HeadSender(std::vector<Way> ways, HeadSenderConfig config);
  double time_s(int64_t sim_time_ns);

  const std::vector<Way> ways_;
  const HeadSenderConfig config_;
  std::optional<int64_t> clock_from_sim_ns_;
  uint32_t number_ = 0;  // of the next packet
  std::atomic<uint64_t> unsent_{0};
};

}  // namespace strandcast
