// NetworkReader: all sessions as one reader of the stream. What each of them wants is a demand of its own;
// the network sends a frame on to those whom it concerns. Any thread.
#pragma once

#include <memory>
#include <vector>

#include "common/base/profile.h"
#include "server/app/frame_stages.h"
#include "server/net/net_server.h"
#include "server/stream/stream_reader.h"

namespace strandcast {

class NetworkReader : public StreamReader {
 public:
  NetworkReader(NetServer& net, FrameStages& stages) : net_(net), stages_(stages) {}

  void on_strands(const EncodedFramePtr& frame) override {
    stages_.note_encoded(frame->header.sim_time_ns, now_ns());
    net_.publish_strands(frame);
  }
  void on_picture(PictureClass picture_class, const PicturePtr& picture) override {
    net_.publish_picture(picture_class, picture);
  }
  void on_picture_refused(PictureClass picture_class, const Error& error) override {
    net_.send_to_class(picture_class, Notice{true, "This view cannot be drawn: " + error.to_string()});
  }
  void on_look_refused(PictureClass picture_class, const Error& error) override {
    net_.send_to_class(picture_class, Notice{true,
                                             "The server's pictures keep their look, this one cannot be "
                                             "drawn there: " +
                                                 error.to_string()});
  }
  void on_look_change(const LookChange& look) override { net_.broadcast(look); }
  void on_pictures_failed(const Error& error) override {
    net_.broadcast(Notice{true, "No frames can be drawn: " + error.to_string()});
  }
  /// The network thread tells every viewer first.
  void on_stream_change(const std::vector<StrandClass>& classes, std::shared_ptr<void> until_told) override {
    net_.set_strand_classes(classes, "the stream was changed", [until_told] {});
  }

 private:
  NetServer& net_;
  FrameStages& stages_;
};

}  // namespace strandcast
