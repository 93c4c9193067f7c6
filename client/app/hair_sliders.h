// HairSliders: what a newcomer changes first, on top of the panel: quality and the factors on hair
// (common/scene/hair_controls.h) as the server lists them, moved by whoever may steer. Pure logic on given
// times, one thread.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/window/form.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Of a ParameterRequest: what the sliders are made of.
inline constexpr const char* kHairSliderPrefixes = "quality,hair.";
/// Whether a parameter has a slider here, of a server that can change it.
bool has_hair_slider(const ParameterInfo& parameter);

class HairSliders {
 public:
  /// The newest values of the server, and whether this session may change them.
  void follow(const std::vector<ParameterInfo>& parameters, bool is_steering);
  /// Takes those of the edits that are of these sliders; the others stay.
  void take_edits(std::vector<FormEdit>& edits, int64_t time_ns);
  /// What SetParameter is to say now, one slider at a time.
  std::optional<std::string> take_assignment(int64_t time_ns);

  /// With what was done and the server has not said yet; greyed where this session may not steer.
  std::vector<FormField> fields(int64_t time_ns) const;
  /// Why they are greyed; empty where they are not.
  std::string reason() const;

 private:
  struct Held {
    std::string value;
    int64_t time_ns = 0;
    bool is_sent = false;
  };
  std::vector<ParameterInfo> parameters_;
  bool is_steering_ = false;
  std::map<std::string, Held> held_;  // by path
  int64_t sent_ns_ = 0;               // 0 = never
};

}  // namespace strandcast
