// NetworkReader: all sessions as one reader of the stream. What each of them wants is a demand of its own;
// the network sends a frame on to those whom it concerns. Any thread.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "server/app/frame_stages.h"
#include "server/net/net_server.h"
#include "server/stream/stream_reader.h"

namespace strandcast {

class NetworkReader : public StreamReader {
 public:
  using OnClasses = std::function<void(const std::vector<StrandClass>&, const std::string& reason)>;
  /// Makes the message of another asset, for who joins from now on too; null: there is none.
  using OnShape = std::function<EncodedFramePtr(const SceneAsset&)>;
  /// `head`: of those of the network, that the stream is of. The others are called before any viewer is told.
  NetworkReader(NetServer& net, FrameStages& stages, size_t head, OnClasses on_classes, OnShape on_shape)
      : net_(net),
        stages_(stages),
        head_(head),
        on_classes_(std::move(on_classes)),
        on_shape_(std::move(on_shape)) {}

  void on_strands(const EncodedFramePtr& frame) override {
    stages_.note_encoded(frame->header.sim_time_ns, now_ns());
    net_.publish_strands(frame, head_);
  }
  void on_picture(PictureClass picture_class, const PicturePtr& picture) override {
    net_.publish_picture(picture_class, picture, head_);
  }
  void on_picture_refused(PictureClass picture_class, const Error& error) override {
    net_.send_to_class(picture_class, Notice{true, "This view cannot be drawn: " + error.to_string()}, head_);
  }
  void on_look_refused(PictureClass picture_class, const Error& error) override {
    net_.send_to_class(
        picture_class,
        Notice{true,
               "The server's pictures keep their look, this one cannot be drawn there: " + error.to_string()},
        head_);
  }
  void on_look_change(const LookChange& look) override { net_.broadcast(look, head_); }
  void on_pictures_failed(const Error& error) override {
    net_.broadcast(Notice{true, "No frames can be drawn: " + error.to_string()}, head_);
  }
  /// The network thread tells every viewer first.
  void on_stream_change(const std::vector<StrandClass>& classes, std::shared_ptr<void> until_told) override {
    constexpr const char* kReason = "the stream was changed";
    on_classes_(classes, kReason);
    net_.set_strand_classes(
        classes, kReason, [until_told] {}, head_);
  }

  void on_shape_change(const std::shared_ptr<const SceneAsset>& asset,
                       std::shared_ptr<void> until_told) override {
    const EncodedFramePtr frame = on_shape_(*asset);
    if (frame != nullptr)
      net_.renew_asset(
          frame, [until_told] {}, head_);
  }

 private:
  NetServer& net_;
  FrameStages& stages_;
  const size_t head_;
  const OnClasses on_classes_;
  const OnShape on_shape_;
};

}  // namespace strandcast
