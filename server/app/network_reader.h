// NetworkReader: all sessions of the network as one reader of the stream. Each session has a demand of its
// own; the network forwards a frame to the sessions that it concerns. Any thread.
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
  /// Function that makes the asset message after a change of shape; sessions that join later get it too. A
  /// null message means that none fits.
  using OnShape = std::function<EncodedFramePtr(const SceneAsset&)>;
  /// Makes the reader of a stream; `head` is its number in the network. The callbacks run before any message
  /// goes to a viewer.
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
    net_.broadcast(Notice{true, "No pictures can be drawn: " + error.to_string()}, head_);
  }
  /// The network thread tells every viewer before the new classes are used.
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
