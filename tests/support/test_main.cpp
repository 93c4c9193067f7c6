// The entry of every test program. What its tests cost goes into the results file that the summary reads:
// seconds of processor time, of the process and of the programs that it waited for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <string>

#include "common/base/units.h"

namespace strandcast {
namespace {

double processor_s(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         kSPerUs * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

class ProcessorTime : public testing::Environment {
 public:
  void TearDown() override {
    testing::Test::RecordProperty("processor_s",
                                  std::to_string(processor_s(RUSAGE_SELF) + processor_s(RUSAGE_CHILDREN)));
  }
};

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  testing::AddGlobalTestEnvironment(new strandcast::ProcessorTime);  // gtest deletes it
  return RUN_ALL_TESTS();
}
