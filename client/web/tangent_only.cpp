// For the module that the page begins with, which decodes "tangent": of frames of other codecs it says that
// another module has to.
#include "common/strands/strand_payload.h"
#include "common/strands/tangent/codec.h"

namespace strandcast {
namespace {

class OtherModule final : public StrandDecoder {
 public:
  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte>) override {
    return make_error(ErrorCode::Unsupported, "this module decodes tangent alone");
  }
};

}  // namespace

std::unique_ptr<StrandDecoder> make_raw_decoder(const StrandStreamLimits&) {
  return std::make_unique<OtherModule>();
}
std::unique_ptr<StrandDecoder> make_delta_decoder(const StrandStreamLimits&) {
  return std::make_unique<OtherModule>();
}
std::unique_ptr<StrandDecoder> tangent::make_step_decoder(const StrandStreamLimits&, WorkerPool&) {
  return std::make_unique<OtherModule>();
}

}  // namespace strandcast
