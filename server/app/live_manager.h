// LiveManager: runs a server's live inputs. It opens their sockets, passes received bytes to each LiveSource
// and the results to the inputs and their readers, writes the log and answers commands. Heads that use the
// same protocol, port and host share a socket, and each follows its own subject. Exists only if a scene has
// live inputs. Functions run on the receiver's thread unless marked as callable from any thread.
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
#include "server/net/address_guard.h"
#include "server/net/live_receiver.h"

namespace strandcast {

/// Checks every input separately; BadInput and NotFound name the field. Opens nothing.
Status check_live(const std::vector<LiveDesc>& live);
/// Returns a line per input: the accepted senders, the subject that the head follows, and how its data is
/// interpreted. Opens nothing.
Result<std::vector<std::string>> explain_live(const std::vector<LiveDesc>& live,
                                              const std::vector<AddressRange>& allowed);

class LiveManager : public LiveHandler {
 public:
  /// Observer of the motion that drives the head; called on the receiver's thread.
  struct Listener {
    std::function<void(uint64_t source_id, const MotionSamples&, int64_t arrival_ns)> on_motion;
    std::function<void(uint64_t source_id, const WindSamples&, int64_t arrival_ns)> on_wind;
    /// A sender's wish, once where several heads hear it; empty: nothing can be recorded.
    std::function<void(const RecordCommand&)> on_record;
  };

  /// The live inputs of one head, and the receivers of their data.
  struct Target {
    std::vector<LiveDesc> live;
    InputHub* inputs = nullptr;  // outlives the manager
    Listener listener;
    std::string head = {};  // its name, for the log and errors; empty where there is one
  };

  /// Opens the sockets of all targets.
  static Result<std::unique_ptr<LiveManager>> open(std::vector<Target> targets,
                                                   const std::vector<AddressRange>& allowed);
  ~LiveManager() override;

  void start();
  void stop();

  // From any thread; of one head, by its number among the targets.
  std::vector<LiveInputStatus> status(size_t head = 0) const;
  /// Returns the live inputs as they run, with the chosen subjects.
  std::vector<LiveDesc> live(size_t head = 0) const;
  /// Carries out a command; the notice says in one sentence what happened.
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
  LiveManager(std::vector<Target> targets, std::vector<Input> inputs);
  template <class Work>
  void for_head(size_t head, Work work) const;
  template <class Work>
  void for_socket(size_t socket, Work work) const;
  LiveSource& first_of(size_t socket) const;
  void pass_on(const Input& input, int64_t now_ns);
  std::string name_of(const Input& input) const;
  void write(const std::string& name, const LiveNote& note);
  Notice choose_subject(const std::string& subject, size_t head);

  mutable std::mutex mutex_;  // guards what is in the sources
  const std::vector<Target> targets_;
  const std::vector<Input> inputs_;
  RepeatBudget lines_;
  LogBudget refusal_lines_;
  std::vector<std::string> troubles_;  // of connections, as told last, by socket
  std::unique_ptr<LiveReceiver> receiver_;
};

}  // namespace strandcast
