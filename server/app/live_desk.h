// LiveDesk: what a server does with its live inputs: opens their sockets, hands what comes to each LiveSource
// and what that makes of it to the inputs and to readers of inputs, writes the log, and answers commands.
// Heads that ask for the same protocol, port and host share its socket: each follows a subject of its own.
// Made only where a scene asks for live inputs. What is marked so from any thread, the rest on the
// receiver's.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/scene/live_desc.h"
#include "common/wire/messages.h"
#include "server/input/input_hub.h"
#include "server/input/live/live_source.h"
#include "server/net/live_receiver.h"
#include "server/net/log_budget.h"

namespace strandcast {

/// Ids of live inputs among the sources of motion; sessions count from 1.
inline constexpr uint64_t kFirstLiveSourceId = uint64_t{1} << 63;

/// Every input on its own: BadInput and NotFound name the field. Opens nothing.
Status check_live(const std::vector<LiveDesc>& live);
/// A line for each: who is heard, whom the head follows, and how its numbers are taken. Opens nothing.
Result<std::vector<std::string>> explain_live(const std::vector<LiveDesc>& live,
                                              const std::vector<AddressRange>& allowed);

class LiveDesk : public LiveHandler {
 public:
  /// Who else hears of what drives the head; on the receiver's thread.
  struct Listener {
    std::function<void(uint64_t source_id, const MotionSamples&, int64_t arrival_ns)> on_motion;
    std::function<void(uint64_t source_id, const WindSamples&, int64_t arrival_ns)> on_wind;
  };

  /// The live inputs of one head, and where they go.
  struct Target {
    std::vector<LiveDesc> live;
    InputHub* inputs = nullptr;  // outlives the desk
    Listener listener;
    std::string head = {};  // its name, for the log and errors; empty where there is one
  };

  /// Opens the sockets.
  static Result<std::unique_ptr<LiveDesk>> open(std::vector<Target> targets,
                                                const std::vector<AddressRange>& allowed);
  ~LiveDesk() override;

  void start();
  void stop();

  // From any thread; of one head, by its number among the targets.
  std::vector<LiveInputStatus> status(size_t head = 0) const;
  /// As it runs: subjects as they were chosen.
  std::vector<LiveDesc> live(size_t head = 0) const;
  /// What became of it, in one sentence.
  Notice obey(const LiveCommand& command, size_t head = 0);

  bool on_bytes(size_t socket, const std::string& sender, std::span<const std::byte> bytes,
                int64_t arrival_ns) override;
  void on_refused(size_t socket, const std::string& sender, const std::string& remedy) override;
  void on_connection(size_t socket) override;
  void on_no_connection(size_t socket, const std::string& why) override;
  std::vector<std::byte> greeting(size_t socket) override;
  std::vector<std::byte> request(size_t socket) override;
  bool on_tick(int64_t now_ns) override;

 private:
  struct Input {
    std::unique_ptr<LiveSource> source;
    uint64_t id = 0;    // among the sources of motion of its head
    size_t head = 0;    // that it moves
    size_t socket = 0;  // that it hears
  };
  LiveDesk(std::vector<Target> targets, std::vector<Input> inputs);
  template <class Work>
  void for_head(size_t head, Work work) const;
  template <class Work>
  void for_socket(size_t socket, Work work) const;
  LiveSource& first_of(size_t socket) const;
  void pass_on(const Input& input, int64_t now_ns);
  std::string name_of(const Input& input) const;
  void write(LogBudget& budget, const std::string& key, const LiveNote& note, int64_t now_ns);
  Notice choose_subject(const std::string& subject, size_t head);

  mutable std::mutex mutex_;  // guards what is in the sources
  const std::vector<Target> targets_;
  const std::vector<Input> inputs_;
  LogBudget lines_;
  LogBudget refusal_lines_;
  std::vector<std::string> troubles_;  // of connections, as told last, by socket
  std::unique_ptr<LiveReceiver> receiver_;
};

}  // namespace strandcast
