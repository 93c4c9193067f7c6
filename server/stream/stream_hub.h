// StreamHub: connects one source of states with any number of readers. Between them are the encoders and the
// frame renderer, which run only while a reader wants their output. Any thread, unless stated otherwise.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"
#include "server/encode/frame_worker.h"
#include "server/encode/strand_encode_worker.h"
#include "server/publish/snapshot_slot.h"
#include "server/stream/demand_book.h"
#include "server/stream/state_source.h"
#include "server/stream/stream_reader.h"

namespace strandcast {

struct StreamHubConfig {
  StreamDesc stream;
  std::string fallback_codec = {};  // for who cannot decode the stream's, on the same lattice; empty = none
  double step_rate_hz = 60.0;
  PictureView scene_view;  // always has room
  std::shared_ptr<const SceneAsset> asset;
  MakePicturePainter make_painter;  // called when somebody wants pictures
  LookChange look = {};             // that the painters are made with
  SharedSlot* shared = nullptr;     // gets what viewers of all strands have; may be null
  /// Makes a new `make_painter` after a change of rest shape; empty if the shape never changes.
  std::function<MakePicturePainter(const std::shared_ptr<const SceneAsset>&, const LookDesc&)> painter_of =
      {};
  std::function<void(const SnapshotInfo&)> on_state = {};  // hears of each before any reader; may be empty
  std::string picture_codec = {};  // that pictures are drawn from; empty = what every viewer can decode
};

class StreamHub : public StateSink, public DemandSink {
 public:
  /// Makes the hub. NotFound for an unknown codec. Starts only the frame thread, which sleeps.
  static Result<std::unique_ptr<StreamHub>> make(StreamHubConfig config);
  /// Calls stop() if it was not called.
  ~StreamHub() override;
  StreamHub(const StreamHub&) = delete;
  StreamHub& operator=(const StreamHub&) = delete;

  /// Adds a demand slot of a reader, which must exist until remove() or stop(). A reader may have several
  /// slots with ids and shares of their own; it then receives the union of them once.
  ReaderId add(StreamReader& reader, const ReaderTraits& traits = {});
  Result<PictureClass> set_demand(ReaderId reader, const Demand& demand) override;
  PictureBudget picture_budget() const override;
  /// Sets the budget, before the first demand for pictures. Until then it is that of a machine without a GPU.
  void set_picture_budget(const PictureBudget& budget);
  /// Removes a demand; after the return nothing is delivered for it. Must not be called from within the
  /// reader.
  void remove(ReaderId reader);
  /// Sets the function that receives the total demand, at once and whenever it changes.
  void set_source(std::function<void(const SourceDemand&)> on_demand);

  /// Requests a keyframe of this stream for new readers; it comes with the next state. May be called from a
  /// reader's functions.
  void request_keyframe(uint16_t stream_id);
  /// Requests the newest picture of a class again, as a whole picture. May be called from a reader's
  /// functions.
  void request_whole(PictureClass picture_class);
  /// Requests new pictures because something outside of this stream has changed. May be called from any
  /// reader's functions.
  void redraw();

  void put(std::shared_ptr<const Snapshot> state) override;
  void change_stream(const StreamDesc& stream) override;
  void change_look(const LookChange& look) override;
  void change_shape(std::shared_ptr<const SceneAsset> asset) override;
  // What comes in, for readers that want inputs.
  void tell_motion(uint64_t source, const MotionSamples& samples, int64_t arrival_ns);
  void tell_wind(uint64_t source, const WindSamples& samples, int64_t arrival_ns);
  void tell_camera(uint64_t viewer, const CameraDesc& camera);

  StreamDesc stream() const;
  /// Returns the codecs of the strands: the scene's, its fallback, and the one of pictures if it is another.
  /// Each has all classes, whose streams are numbered by stream_id_of(). Only demanded streams are encoded.
  const std::vector<std::string>& strand_codecs() const { return codecs_; }
  /// Returns the newest look.
  LookChange look() const;
  std::vector<StrandClass> strand_classes() const;
  std::map<uint32_t, PictureView> picture_views() const;
  uint32_t strand_readers(uint16_t stream_id) const;
  SourceDemand total() const;
  FrameCounters frame_counters() const;
  /// Does what FrameWorker::take_motions() does.
  std::vector<PictureMotion> take_picture_motions();
  /// Returns the counters of all streams that were ever encoded, by stream_id.
  std::map<uint16_t, StrandEncodeCounters> encode_counters() const;
  /// Return the passes of the encoders and of the frame thread; the latter are empty while nothing is drawn.
  gl::PassReports strand_passes() const;
  gl::PassReports picture_passes() const;
  /// Returns why pictures cannot be drawn; empty while they can.
  std::optional<Error> picture_failure() const;

  /// Ends all threads; the source must have stopped. Readers receive nothing more.
  void stop();

 private:
  struct Entry {
    StreamReader* reader = nullptr;
    PictureClass picture_class = 0;
    Demand demand;
  };
  explicit StreamHub(StreamHubConfig config);
  Status begin();
  void follow_demand();
  bool is_stream(uint16_t stream_id) const;
  StrandEncodeWorker& encoder(uint16_t stream_id);
  StrandEncodeWorker* find_encoder(uint16_t stream_id) const;
  StrandEncodeConfig encode_config(uint16_t stream_id) const;
  std::vector<StrandClass> classes_of(const StreamDesc& stream) const;
  void begin_stream(const StreamDesc& stream, const std::vector<StrandClass>& classes);
  void begin_shape(std::shared_ptr<const SceneAsset> asset, uint64_t number);
  Result<std::unique_ptr<FrameWorker>> make_frames();
  void give_strands(const EncodedFramePtr& frame);
  template <class IsWanted, class Give>
  void give(IsWanted is_wanted, Give give_one);

  const StreamHubConfig config_;
  const std::vector<std::string> codecs_;
  const uint16_t picture_source_;  // the stream that pictures are drawn from
  SnapshotSlot slot_;

  // Held through a change of the demands, so that the source hears of them in order.
  std::mutex demand_mutex_;
  std::function<void(const SourceDemand&)> on_demand_;
  SourceDemand told_;  // to the source

  std::mutex giving_mutex_;   // held while readers are called; taken after demand_mutex_
  mutable std::mutex mutex_;  // guards the block below; taken last, and never held while a reader is called
  std::shared_ptr<const SceneAsset> asset_;
  MakePicturePainter make_painter_;
  uint64_t shapes_ = 0;        // that were told of
  bool is_reshaping_ = false;  // nothing is encoded or drawn until all know of the newest
  StreamDesc stream_;
  LookChange look_;
  std::vector<StrandClass> classes_;
  DemandBook book_;
  std::map<ReaderId, Entry> entries_;
  std::unique_ptr<FrameWorker> frames_;
  std::map<uint16_t, std::unique_ptr<StrandEncodeWorker>> encoders_;  // by stream_id, once somebody needs it
  bool has_stopped_ = false;
};

}  // namespace strandcast
