// The main function of the fuzz targets where libFuzzer is missing: PROGRAM SECONDS [FOLDER] feeds the files of a
// folder, then mutations of them, always the same ones in the same order; without a folder, bytes most of which are
// zero. An input that ends the process stays in PROGRAM-input.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr unsigned kSlowest = 20;       // s for one input
constexpr std::size_t kLargest = 8192;  // bytes of an input
const std::array<std::string, 14> kWords = {"0",          "-1",          "1e-320", "1e308", "99999999999999999999",
                                            "4294967296", "-2147483648", "nan",    "inf",   "0x7fffffff",
                                            "[",          ": ",          "\n",     "%"};

class Mutator {
 public:
  explicit Mutator(std::vector<std::string> seeds) : seeds_(std::move(seeds)) {}

  std::string next() {
    if (seeds_.empty()) return sparse();
    std::string input = seeds_[below(seeds_.size())];
    for (std::size_t mutations = 1 + below(4); mutations > 0; --mutations) mutate(input);
    input.resize(std::min(input.size(), kLargest));
    return input;
  }

 private:
  /// The same with every standard library, other than its distributions.
  std::size_t below(std::size_t count) { return random_() % count; }

  /// Each byte is zero but for one of 1 to 64: many zeros leave most of a message as it was.
  std::string sparse() {
    std::string input(kLargest / 8, '\0');
    const std::size_t rarity = std::size_t{1} << below(7);
    for (char& byte : input)
      if (below(rarity) == 0) byte = static_cast<char>(below(256));
    return input;
  }

  void mutate(std::string& input) {
    const std::size_t from = below(input.size() + 1), count = below(std::min<std::size_t>(input.size() - from, 40) + 1);
    switch (below(5)) {
      case 0:  // another byte
        if (from < input.size()) input[from] = static_cast<char>(below(256));
        break;
      case 1:
        input.erase(from, count);
        break;
      case 2:
        input.insert(below(input.size() + 1), input.substr(from, count));
        break;
      case 3:
        replaceNumber(input, from);
        break;
      case 4: {  // goes on as another seed
        const std::string& other = seeds_[below(seeds_.size())];
        input.replace(from, std::string::npos, other, below(other.size() + 1), std::string::npos);
        break;
      }
    }
  }

  void replaceNumber(std::string& input, std::size_t from) {
    const std::size_t begin = input.find_first_of("-.0123456789", from);
    if (begin == std::string::npos) return;
    const std::size_t end = input.find_first_not_of("-.0123456789e", begin);
    input.replace(begin, std::min(end, input.size()) - begin, kWords[below(kWords.size())]);
  }

  std::vector<std::string> seeds_;
  std::mt19937 random_{1};
};

void feed(const std::string& input, const std::string& kept) {
  std::ofstream(kept, std::ios::binary) << input;
  ::alarm(kSlowest);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::cerr << "usage: " << argv[0] << " SECONDS [FOLDER]\n";
    return 1;
  }
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(std::atoi(argv[1]));
  std::vector<std::string> paths, seeds;
  if (argc == 3)
    for (const auto& entry : std::filesystem::directory_iterator(argv[2])) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    std::ifstream file(path, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  if (argc == 3 && seeds.empty()) {
    std::cerr << argv[2] << " has no seed\n";
    return 1;
  }
  const std::string kept = std::filesystem::path(argv[0]).filename().string() + "-input";
  for (const std::string& seed : seeds) feed(seed, kept);
  std::size_t inputs = seeds.size();
  for (Mutator mutator(seeds); Clock::now() < end; ++inputs) feed(mutator.next(), kept);
  std::filesystem::remove(kept);
  std::cout << "Done " << inputs << " inputs\n";
  return 0;
}
