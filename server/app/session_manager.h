// SessionManager: the application's side of sessions: admits them, gives each a demand on the stream,
// forwards their messages, and changes them between strands and pictures. Network thread, unless stated
// otherwise.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/app/codec_manager.h"
#include "server/app/frame_stages.h"
#include "server/app/live_manager.h"
#include "server/app/parameter_watch.h"
#include "server/app/record_manager.h"
#include "server/app/stream_announcer.h"
#include "server/app/viewers.h"
#include "server/input/input_hub.h"
#include "server/net/net_server.h"
#include "server/stream/state_source.h"
#include "server/stream/stream_hub.h"
#include "server/stream/stream_reader.h"

namespace strandcast {

/// Sustained number of commands and changes per second of one controller.
inline constexpr double kControlsPerS = 60.0;
/// Number of commands and changes that a controller may send at once after a quiet time.
inline constexpr double kControlBurst = 120.0;

/// Limits how many commands and changes each controller may send; the simulation bounds their cost. Plain
/// logic on given times.
class ControlBudget {
 public:
  /// Counts one command or change; returns false if it exceeds the limit.
  bool take(SessionId session, int64_t time_ns);
  void remove(SessionId session) { buckets_.erase(session); }

 private:
  struct Bucket {
    double left = kControlBurst;
    int64_t time_ns = 0;
  };
  std::map<SessionId, Bucket> buckets_;
};

/// Returns 16 hex digits that differ at every start of a server or relay.
std::string make_start_id();

/// Makes the message of an asset. LimitExceeded if the asset is too large for a message.
Result<EncodedFramePtr> make_asset_frame(const SceneAsset& asset);

class SessionManager : public NetHandler, private StreamReader {
 public:
  /// Objects that must outlive the manager. `asset` is the message for viewers of strands.
  struct Parts {
    const SceneDesc& scene;
    StreamHub& hub;
    StateSource& source;
    InputHub& inputs;
    FrameStages& stages;
    std::vector<StrandCodecInfo> codecs;  // that strands are served by, as served_codecs()
    EncodedFramePtr asset;
    bool is_drawn_by_processors = true;   // pictures
    LiveManager* live = nullptr;          // null: no live inputs
    size_t head = 0;                      // number of this one among those of the server
    std::vector<std::string> heads = {};  // names of all where there are several
    /// Returns the scene with all heads as it runs; empty if there is no scene.
    std::function<std::optional<SceneDesc>()> whole_scene = {};
    /// Returns why that quality runs which does, where nobody has chosen it.
    std::function<std::string()> quality_reason = {};
    RecordManager* records = nullptr;             // null: nothing is recorded here
    const RecordManagers* all_records = nullptr;  // of all heads, where there are several
    std::vector<StateSource*> sources = {};       // likewise
  };
  explicit SessionManager(Parts parts);

  /// Connects the manager to the network before `net` starts; `net` must outlive the sessions.
  void connect(NetServer& net);
  /// Sets the function that returns further lines for /metrics; any thread may call it.
  void set_metrics(std::function<std::string()> metrics) { metrics_ = std::move(metrics); }

  // From any thread.
  uint32_t viewer_count() const { return viewers_.viewer_count(); }
  bool is_shut_down_wanted() const { return is_shut_down_wanted_; }
  /// Returns the message of the newest asset.
  EncodedFramePtr asset() const;
  /// Sends the status to every session, with the recording's state that the session may see; call it about
  /// twice a second.
  void tell_status(ServerStatus status);
  /// Sends the states' times to sessions that requested them; call it about twice a second.
  void tell_state_times();
  /// Sends relays the list of streams if the simulated strands have changed; call it about twice a second.
  void tell_streams();
  /// Sends changed parameters to the sessions that watch them; call it after each change.
  void tell_parameters();

  Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) override;
  void on_message(SessionId session, const ClientMessage& message, int64_t arrival_ns) override;
  void on_need(SessionId session, const StreamNeed& need) override;
  void on_change(SessionId session, SubscriptionChange change) override;
  bool on_picture_step(SessionId session, size_t step, const std::string& reason) override;
  LinkAnswer on_link(SessionId session, const LinkState& link, int64_t time_ns) override;
  void on_left(SessionId session) override;
  Status readiness() override;
  std::string metrics() override { return metrics_ ? metrics_() : std::string(); }

 private:
  // Of the stream, for all sessions of this head together.
  void on_strands(const EncodedFramePtr& frame) override;
  void on_picture(PictureClass picture_class, const PicturePtr& picture) override;
  void on_picture_refused(PictureClass picture_class, const Error& error) override;
  void on_look_refused(PictureClass picture_class, const Error& error) override;
  void on_look_change(const LookChange& look) override;
  void on_pictures_failed(const Error& error) override;
  void on_stream_change(const std::vector<StrandClass>& classes, std::shared_ptr<void> until_told) override;
  void on_shape_change(const std::shared_ptr<const SceneAsset>& asset,
                       std::shared_ptr<void> until_told) override;
  void list_classes(const std::vector<StrandClass>& classes, const std::string& reason);

  void tell_refusal(SessionId session, std::string why);
  void obey(SessionId session, const ControlCommand& command);
  void control(SessionId session, const ControlCommand& command);
  void obey(SessionId session, const SetParameter& parameter);
  void obey(SessionId session, const LiveCommand& command);
  void obey(SessionId session, const CameraCommand& command);
  void obey(SessionId session, const RecordCommand& command);
  void answer(SessionId session, const SceneRequest& request);
  void answer(SessionId session, const ParameterRequest& request);
  std::vector<ParameterInfo> listed(const SceneDesc& scene) const;
  void answer(SessionId session, const StateTimesRequest& request);
  void move_camera(SessionId session, const CameraChange& camera);
  void follow_window(SessionId session, const WindowChange& window);
  Welcome make_welcome(const Viewers::Place& place, const ViewerCodec& codec) const;
  std::optional<Admission::Preview> preview(const ViewerCodec& codec, bool is_wish) const;
  bool may_control(SessionId session, std::string_view what);
  Status may_change(const std::string& assignment) const;
  EncodedFramePtr follow_shape(const SceneAsset& asset);
  StateSource::Reply reply_to(SessionId session, const std::string& what);
  void tell_quality(SessionId session, const Viewers::Pictures& pictures, const std::string& reason);

  const Parts parts_;
  const std::string session_id_;
  Viewers viewers_;
  CodecManager codecs_;
  StreamAnnouncer announcer_;
  ControlBudget control_budget_;
  ControlBudget parameter_budget_;  // of requests for parameters
  ParameterWatch parameter_watch_;
  std::set<SessionId> whole_viewers_;  // who named no head of several, and so sees all
  NetServer* net_ = nullptr;
  std::function<std::string()> metrics_;
  mutable std::mutex asset_mutex_;  // guards the one below
  EncodedFramePtr asset_;
  std::mutex times_mutex_;             // guards the one below
  std::set<SessionId> times_readers_;  // who asked for StateTimes
  std::atomic<bool> is_shut_down_wanted_{false};
};

}  // namespace strandcast
