#include <cstdint>
#include <stdexcept>
#include <string_view>

#include "app/files/recording_file.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/sampled.h"

// Whatever the bytes: either a trajectory that can be sampled, or one std::runtime_error. What stands before the first
// zero byte describes the rest: XML, or a number for one of these.
static const char* const descriptions[] = {
    "<recording file='r' map='jigsaws' part='slave_right'/>",
    "<recording file='r' map='sofa'><units length='mm'/></recording>", "<recording file='r' map='ros'/>",
    "<recording file='r'><columns rate='30' position='1 2 3' quaternion='4 5 6 7' grip='8' force='1 2 3'/>"
    "<frame mirror='x' scale='0.5' tool='0 1 0 0'/><span from='0.1' to='2' smooth='0.2'/></recording>",
    "<recording file='r'><columns time='t' position='x y z' matrix='a b c d e f g h i'/></recording>"};

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text(reinterpret_cast<const char*>(data), size);
  std::string_view description = text.substr(0, text.find('\0'));
  text.remove_prefix(std::min(description.size() + 1, text.size()));
  if (description.size() == 1) description = descriptions[static_cast<unsigned char>(description[0]) % 5];
  try {
    const medulla::MemoryFile file(reinterpret_cast<const std::uint8_t*>(description.data()), description.size());
    medulla::sampleThroughout(medulla::parseRecording(text, "fuzz.txt", medulla::readRecordingMap(file.path())));
  } catch (const std::runtime_error&) {
  }
  return 0;
}
