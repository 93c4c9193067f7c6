// Viewers: chooses which of strands and pictures each session gets, and demands it of the stream. What it
// gets stands in its Subscription and nowhere else. Network thread; the count may be read from any thread.
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
#include "server/net/net_handler.h"
#include "server/stream/demand.h"

namespace strandcast {

/// At most one ModeRequest of a viewer is carried out in this time.
inline constexpr int64_t kModeRequestNs = 1'000'000'000;
/// A change whose first frame does not come in this time is given up.
inline constexpr int64_t kModeChangeNs = 20'000'000'000;

RenderSize scene_picture_size(const SceneDesc& scene);
/// The scene's camera and quality at this size, in the best codec of those that are decodable.
PictureView make_scene_view(const SceneDesc& scene, const RenderSize& size, PictureCodecs decodable);

class Viewers {
 public:
  /// What a joining session gets.
  struct Place {
    std::string reason;  // of the mode, for a person
    RenderSize size;
  };
  /// What a viewer of frames gets.
  struct Pictures {
    PictureClass picture_class = 0;
    PictureView view;
  };

  /// `desk` outlives this.
  Viewers(const SceneDesc& scene, DemandDesk& desk) : scene_(scene), desk_(desk) {}

  /// Of those who join from now on, until they say their own.
  void set_scene_camera(const CameraDesc& camera) { scene_.camera = camera; }
  /// A Source gets a place too, without any stream. Unavailable while too many pictures are drawn for others,
  /// BadInput for a size that cannot be drawn.
  /// `subscription` is filled in, and outlives the session's place here.
  Result<Place> add(SessionId session, ReaderId reader, Subscription& subscription, const Hello& hello);
  /// Its reader is the caller's to remove; 0 for an unknown session.
  ReaderId remove(SessionId session);
  /// Where a session comes from, for describe().
  void note_address(SessionId session, const std::string& address);
  /// For the log: number, role, name and address.
  std::string describe(SessionId session) const;
  /// Of a viewer of strands it is kept for later. NotFound for a session that views nothing.
  Status set_camera(SessionId session, const CameraDesc& camera);
  /// Whom a command about cameras concerns.
  struct Aimed {
    std::vector<SessionId> movable;
    std::vector<SessionId> own;  // keep their own
  };
  /// `whose` 0: all that view but `by`. NotFound names those that view.
  Result<Aimed> aimed_at(SessionId by, SessionId whose) const;

  /// What the viewer says of itself; the newest counts.
  void set_report(SessionId session, const ViewerReport& report);
  ViewerReport report(SessionId session) const;
  /// What the person wants; of requests within kModeRequestNs the newest counts.
  void request_mode(SessionId session, StreamMode mode);
  bool has_request(SessionId session) const;
  /// Call often: may begin or give up a change in the subscription. What to tell the session.
  std::optional<ModeChange> consider(SessionId session, const ModeFacts& facts, int64_t time_ns);
  /// A change is done.
  void note_mode(SessionId session, int64_t time_ns);

  /// Moves the viewer along its ladder, in its subscription. NotFound for a session without pictures,
  /// Unavailable as in PictureViews; it then keeps what it had.
  Result<Pictures> set_picture_step(SessionId session, size_t step);
  /// Nothing for a session without pictures.
  std::optional<Pictures> pictures(SessionId session) const;

  /// The session has put another strand class into its subscription; it joins with class 0.
  void note_strand_class(SessionId session);
  /// The size of its pictures.
  RenderSize picture_size(SessionId session) const;

  /// All who watch.
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
  DemandDesk& desk_;
  std::atomic<uint32_t> viewer_count_{0};
};

}  // namespace strandcast
