// Viewers: chooses strands or pictures for each session and sets its demand on the stream. A session's choice
// is stored only in its Subscription. Network thread; the count may be read from any thread.
#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"
#include "server/app/mode_policy.h"
#include "server/encode/picture_ladder.h"
#include "server/net/net_server.h"
#include "server/stream/demand.h"

namespace strandcast {

/// Shortest time between two changes that a viewer requests by ModeRequest.
inline constexpr int64_t kModeRequestNs = 1'000'000'000;
/// Time after which a change is abandoned if its first frame has not come.
inline constexpr int64_t kModeChangeNs = 20'000'000'000;

RenderSize scene_picture_size(const SceneDesc& scene);
/// Returns the scene's camera and quality at this size, in the best of the `decodable` codecs.
PictureView make_scene_view(const SceneDesc& scene, const RenderSize& size, PictureCodecs decodable);

class Viewers {
 public:
  /// What a joining session gets.
  struct Place {
    std::string reason;  // of the mode, for a person
    RenderSize size;
  };
  /// Pictures that a viewer gets: its class and its step on the quality ladder.
  struct Pictures {
    PictureClass picture_class = 0;
    PictureView view;
  };

  /// Makes an empty set; `demand_sink` must outlive it.
  Viewers(const SceneDesc& scene, DemandSink& demand_sink) : scene_(scene), demand_sink_(demand_sink) {}

  /// Sets the camera of viewers that join from now on, until they send their own.
  void set_scene_camera(const CameraDesc& camera) { scene_.camera = camera; }
  /// Adds a session; a Source gets an entry without any stream. Fills in `subscription`, which must outlive
  /// the entry. Unavailable while too many pictures are drawn for others, BadInput for a size that cannot be
  /// drawn.
  Result<Place> add(SessionId session, ReaderId reader, Subscription& subscription, const Hello& hello);
  /// Removes a session and returns its reader, which the caller must remove; 0 for an unknown session.
  ReaderId remove(SessionId session);
  /// Notes a session's address for describe().
  void note_address(SessionId session, const std::string& address);
  /// Describes a session for the log: number, role, name and address.
  std::string describe(SessionId session) const;
  /// Sets a viewer's camera; for a viewer of strands it is stored for later. NotFound for a session that
  /// views nothing.
  Status set_camera(SessionId session, const CameraDesc& camera);
  /// Sets the size of a viewer's pictures and whether its window is hidden, and returns the reason of the
  /// size for a person. NotFound for a session that views nothing. Unavailable as in add(): the viewer keeps
  /// its size, and stays hidden if it was.
  Result<std::string> set_window(SessionId session, const WindowChange& window);
  /// Sessions that a command about cameras concerns.
  struct Aimed {
    std::vector<SessionId> movable;
    std::vector<SessionId> own;  // keep their own
  };
  /// Returns the sessions a camera command is aimed at; `whose` 0 means all viewers except `by`. NotFound
  /// lists the viewers.
  Result<Aimed> aimed_at(SessionId by, SessionId whose) const;

  /// Stores the newest report of a viewer about itself.
  void set_report(SessionId session, const ViewerReport& report);
  ViewerReport report(SessionId session) const;
  /// Notes the mode that the person wants; of requests within kModeRequestNs only the newest counts.
  void request_mode(SessionId session, StreamMode mode);
  bool has_request(SessionId session) const;
  /// Begins or abandons a change of mode in the subscription if needed; call it often. Returns the message
  /// for the session, if any.
  std::optional<ModeChange> consider(SessionId session, const ModeFacts& facts, int64_t time_ns);
  /// Notes that a change of mode is complete.
  void note_mode(SessionId session, int64_t time_ns);

  /// Moves a viewer along its quality ladder, in its subscription. NotFound for a session without pictures.
  /// Unavailable as in PictureViews; then nothing changes.
  Result<Pictures> set_picture_step(SessionId session, size_t step);
  /// Returns a viewer's pictures; empty for a session without pictures.
  std::optional<Pictures> pictures(SessionId session) const;

  /// Notes that the session's subscription has another strand class; it joins with class 0.
  void note_strand_class(SessionId session);
  /// Returns whether nobody sees a session's window.
  bool is_hidden(SessionId session) const;
  /// Returns the size of a session's pictures.
  RenderSize picture_size(SessionId session) const;

  /// Returns the number of viewers.
  uint32_t viewer_count() const { return viewer_count_; }

 private:
  struct Viewer {
    Role role = Role::Viewer;
    bool keeps_camera = false;
    std::string name;
    std::string address;
    ReaderId reader = 0;
    Subscription* subscription = nullptr;     // the session's
    StreamMode wanted = StreamMode::Strands;  // may be Auto
    PictureView view;
    RenderSize size;  // of its pictures, at the first steps of
    std::vector<PictureStep> ladder;
    ViewerReport report;
    ModePolicy policy;
    std::optional<StreamMode> request;  // not yet looked at
    int64_t request_ns = 0;             // when the one before was; 0 = never
    bool is_answer_due = false;

    bool gets(StreamMode kind) const { return subscription->gets(kind); }
  };
  static Demand demand_of(const Viewer& viewer, const Subscription& wanted, const PictureView& view);
  Status change(Viewer& viewer, Subscription wanted, const PictureView& view);
  void change_surely(Viewer& viewer, const Subscription& wanted);
  ModeChoice choose(Viewer& viewer, const ModeFacts& facts, int64_t time_ns);
  ModeChange begin_change(Viewer& viewer, const ModeChoice& choice, int64_t time_ns);
  ModeChange stay(Viewer& viewer, const std::string& reason);
  void count();

  SceneDesc scene_;
  std::map<SessionId, Viewer> viewers_;
  DemandSink& demand_sink_;
  std::atomic<uint32_t> viewer_count_{0};
};

}  // namespace strandcast
