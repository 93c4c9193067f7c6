// LiveDesk: what a server does with its live inputs: opens their sockets, hands what comes to each LiveSource
// and what that makes of it to the inputs and to readers of inputs, writes the log, and answers commands.
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

  /// Opens the sockets. `inputs` outlives the desk.
  static Result<std::unique_ptr<LiveDesk>> open(const std::vector<LiveDesc>& live,
                                                const std::vector<AddressRange>& allowed, InputHub& inputs,
                                                Listener listener);
  ~LiveDesk() override;

  void start();
  void stop();

  // From any thread.
  std::vector<LiveInputStatus> status() const;
  /// As it runs: subjects as they were chosen.
  std::vector<LiveDesc> live() const;
  /// What became of it, in one sentence.
  Notice obey(const LiveCommand& command);

  bool on_bytes(size_t input, const std::string& sender, std::span<const std::byte> bytes,
                int64_t arrival_ns) override;
  void on_refused(size_t input, const std::string& sender, const std::string& remedy) override;
  void on_connection(size_t input) override;
  void on_no_connection(size_t input, const std::string& why) override;
  std::vector<std::byte> greeting(size_t input) override;
  std::vector<std::byte> request(size_t input) override;
  bool on_tick(int64_t now_ns) override;

 private:
  using Sources = std::vector<std::unique_ptr<LiveSource>>;
  LiveDesk(Sources sources, InputHub& inputs, Listener listener);
  void pass_on(size_t input, int64_t now_ns);
  void write_notes(LiveSource& source, int64_t now_ns);
  void write(LogBudget& budget, const std::string& key, const LiveNote& note, int64_t now_ns);
  Notice choose_subject(const std::string& subject);

  mutable std::mutex mutex_;  // guards what is in the sources
  const Sources sources_;
  InputHub& inputs_;
  const Listener listener_;
  LogBudget lines_;
  LogBudget refusal_lines_;
  std::vector<std::string> troubles_;  // of connections, as told last
  std::unique_ptr<LiveReceiver> receiver_;
};

}  // namespace strandcast
