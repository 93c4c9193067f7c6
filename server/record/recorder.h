// Recorder: records the stream as its reader, and the simulation as its tap. Callers only queue data; one
// thread makes chunks, and another writes them (RecordFile).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/record/record_file.h"
#include "common/record/recording_writer.h"
#include "server/source/step_tap.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

/// Limits of what may wait for the recorder's thread: bytes of states and frames, number of other items.
inline constexpr uint64_t kMaxRecorderBytes = 64u << 20;
inline constexpr size_t kMaxRecorderItems = 1u << 16;
inline constexpr int64_t kRecordFlushNs = 1'000'000'000;
/// Intervals of keyframes. The first is the shortest, in simulated time. The second is the processor time
/// that decoding up to any moment may take, unless frames of the first interval take longer. A keyframe takes
/// as many bytes as many seconds of deltas.
inline constexpr int64_t kRecordKeyframeNs = 2'000'000'000;
inline constexpr double kRecordSeekMs = 170.0;
/// A keyframe is requested after this time whatever decoding takes, and comes within a second: damage to one
/// frame costs at most 5 s.
inline constexpr int64_t kRecordMostKeyframeNs = 4'000'000'000;
/// Decoding costs per vertex: of a frame without prediction, of a predicted frame without its steps, and of a
/// step of dftl. Measured by scrub_bench. Exact frames cost their steps alone.
inline constexpr double kRecordDecodeNs = 36.0;
inline constexpr double kRecordPredictedNs = 21.0;
inline constexpr double kRecordStepNs = 10.0;

/// Estimates what decoding from the last keyframe on takes. Pure.
class SeekCost {
 public:
  /// A delta, and the steps that led to it.
  struct Delta {
    bool is_exact = false;
    uint64_t vertex_count = 0;
    double step_cost = 0.0;  // of all of them, relative to one of dftl
  };
  /// `is_predicted`: by the codec.
  explicit SeekCost(bool is_predicted = false) : is_predicted_(is_predicted) {}
  void add(const Delta& delta);
  /// Returns whether it is time for a keyframe, so long after the last one, in simulated time.
  bool is_keyframe_due(int64_t passed_ns) const;

 private:
  bool is_predicted_;
  double exact_ns_ = 0.0;
  double usual_ns_ = 0.0;  // if no frame were exact
};

struct RecordConfig {
  std::filesystem::path path;
  IfPresent if_present = IfPresent::Refuse;
  double keyframe_s = 0.0;  // of exact frames, from one to the next; 0: by what decoding takes
};

/// Totals since start.
struct RecordCounters {
  uint64_t written_bytes = 0;
  uint64_t waiting_bytes = 0;  // for the disk, now
  uint64_t frame_bytes = 0;    // of strands as they were encoded
  uint64_t frames = 0;
  uint64_t states = 0;
  uint64_t last_tick = 0;  // of a state
  uint64_t lost_frames = 0;
  uint64_t lost_messages = 0;
  double length_s = 0.0;  // of simulation
  double lag_ms = 0.0;    // of the newest that became part of a chunk behind when it came
  bool has_failed = false;
};

class Recorder : public StreamReader, public StepTap {
 public:
  /// Makes the file; errors as RecordFile::make().
  static Result<std::unique_ptr<Recorder>> make(const RecordConfig& config);
  /// Calls stop(); a recording without begin() leaves no file.
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Subscribes to all states, inputs and strands of the scene's codec; they are queued until begin(). The
  /// hub must exist until stop() or until the recorder is destroyed.
  Status attach(StreamHub& hub);
  /// Begins the recording. `start` describes it; times and codec are filled in here.
  void begin(RecordingStart start, EncodedFramePtr asset);
  void add(const ServerStatus& status);
  /// Sets the cost of decoding a step relative to one of dftl; initially 1. Any thread.
  void set_step_cost(double steps) { step_cost_ = steps; }
  /// Sets whether the simulation goes on from what keyframes tell; initially not. Before begin().
  void set_shared(bool is_shared) { is_shared_ = is_shared; }
  /// Accepts nothing more from any caller but the strands of states that it has, so that all recorded data
  /// ends at one moment. Any thread.
  void refuse();
  /// Waits after refuse() for the strands of the last state, which are still being encoded, for half a second
  /// at most.
  void await_last_strands();
  /// Unsubscribes, closes the file and logs its content; afterwards it is no longer a tap.
  void stop();

  RecordCounters counters() const;
  const std::filesystem::path& path() const { return config_.path; }
  /// Names slate and take for people; empty without either. Not before begin().
  std::string take() const { return take_text(start_.slate, start_.take); }
  /// Describes the file: "3.2 MB, 750 states up to step 812, 748 frames, nothing lost".
  std::string summary() const;
  /// Returns why recording ended by itself; empty while it runs.
  std::optional<Error> failure() const { return file_->failure(); }

  void on_strands(const EncodedFramePtr& frame) override;
  void on_state(const std::shared_ptr<const Snapshot>& state) override;
  void on_motion(uint64_t source, const MotionSamples& samples, int64_t arrival_ns) override;
  void on_wind(uint64_t source, const WindSamples& samples, int64_t arrival_ns) override;
  void on_camera(uint64_t viewer, const CameraDesc& camera) override;
  void on_look_change(const LookChange& look) override;
  void on_step(const TakenStep& step) override;
  void on_change(const PostedChange& change) override;
  void on_answer(const Notice& answer) override;
  void on_lattice(const LatticeChange& change) override;
  void on_hand_over(const HandOver& hand_over) override;

 private:
  using StatePtr = std::shared_ptr<const Snapshot>;
  struct Item {
    int64_t time_ns = 0;
    std::variant<StatePtr, EncodedFramePtr, RecordedMessage> what;
  };

  Recorder(RecordConfig config, std::unique_ptr<RecordFile> file);
  void push_of_simulation(Item item);
  void push(Item item);
  void run();
  void write(const Item& item);
  void write_frame(int64_t time_ns, const EncodedFramePtr& frame);
  void write_held_frame();
  void take_early_frame();
  bool is_keyframe_due(const EncodedFrame& delta);
  void watch_losses();
  void end_early();

  const RecordConfig config_;
  std::unique_ptr<RecordFile> file_;
  StreamHub* hub_ = nullptr;
  ReaderId reader_ = 0;
  uint16_t stream_id_ = 0;
  EncodedFramePtr asset_;
  RecordingStart start_;

  // Of the simulation thread: a change that has no answer yet, and what came of it.
  std::optional<RecordedChange> open_change_;
  std::vector<Item> held_;

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::condition_variable strands_came_;
  std::deque<Item> waiting_;
  uint64_t waiting_bytes_ = 0;
  RecordedLoss refused_;  // that found no place there
  bool is_refusing_ = false;
  bool is_stopping_ = false;
  bool is_ended_ = false;                                  // the file takes nothing any more
  int64_t state_ns_ = INT64_MIN, strands_ns_ = INT64_MIN;  // simulated times of the newest that came
  RecordCounters counters_;

  // Of the recorder's thread.
  std::unique_ptr<RecordingWriter> writer_;
  std::optional<Item> held_frame_;   // the newest delta: a keyframe of the same state takes its place
  std::optional<Item> early_frame_;  // a keyframe that came before the first state
  uint64_t known_lost_frames_ = 0;
  bool is_chain_broken_ = true;
  uint64_t keyframes_ = 0;
  bool is_shared_ = false;
  bool is_predicted_ = false;  // by the codec
  int64_t keyframe_sim_ns_ = 0;
  SeekCost seek_cost_;
  uint64_t decoded_tick_ = 0;  // of the newest frame
  uint64_t vertex_count_ = 0;  // of the newest state
  uint64_t tick_ = 0;          // likewise
  int64_t sim_time_ns_ = 0;
  std::optional<int64_t> first_sim_ns_;

  std::atomic<double> step_cost_{1.0};
  std::thread thread_;
};

}  // namespace strandcast
