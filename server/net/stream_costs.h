// Learns from frames what each strand class, by each codec, and each picture class takes of a link. Plain
// logic on given times; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "common/strands/frame_header.h"
#include "server/net/strand_class.h"

namespace strandcast {

using PictureClass = uint32_t;  // viewers of one class get the same rendered frames

class StrandCosts {
 public:
  /// Makes the costs; there is a model for each served codec.
  StrandCosts(std::vector<StrandClass> classes, std::vector<StrandByteModel> codecs);

  /// Returns the classes, best first.
  const std::vector<StrandClass>& classes() const { return classes_; }
  const std::vector<StrandByteModel>& codecs() const { return codecs_; }
  /// Takes the size of a frame; ignores keyframes and frames of unknown classes.
  void note_frame(const FrameHeader& header, size_t bytes, int64_t time_ns);
  /// Returns the bytes/s of every class by this codec, measured or estimated from the one measured last;
  /// empty at first.
  std::vector<double> bytes_per_s(size_t codec) const;

 private:
  struct Load {
    double delta_bytes = 0.0;  // smoothed
    uint32_t frame_count = 0;
    int64_t time_ns = 0;  // of the newest delta; 0 = none yet
  };
  std::vector<StrandClass> classes_;
  std::vector<StrandByteModel> codecs_;
  std::vector<std::vector<Load>> loads_;  // by codec and class
};

class PictureCosts {
 public:
  /// Takes the size of a picture; classes without pictures for a long time are forgotten.
  void note_picture(PictureClass picture_class, size_t bytes, int64_t time_ns);
  /// Forgets a class whose coding has changed.
  void forget(PictureClass picture_class) { loads_.erase(picture_class); }
  /// Returns the bytes/s of a picture class while its picture changes; 0 = not known yet.
  double bytes_per_s(PictureClass picture_class) const;

 private:
  struct Load {
    double bytes = 0.0;       // smoothed, of one picture; 0 = one came at most
    double interval_s = 0.0;  // smoothed, between two
    int64_t time_ns = 0;      // of the newest
  };
  std::map<PictureClass, Load> loads_;
};

}  // namespace strandcast
