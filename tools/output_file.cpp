#include "tools/output_file.h"

#include <unistd.h>

#include <filesystem>

#include "db/error.h"

namespace patchwork {

namespace {

namespace fs = std::filesystem;

bool takes_whatever_comes(const std::string& path) {
  std::error_code absent;
  const fs::file_status s = fs::status(path, absent);
  return fs::exists(s) && !fs::is_regular_file(s);
}

std::string behind_links(const std::string& path) {
  std::error_code absent;
  const fs::path whole = fs::canonical(path, absent);
  return absent ? path : whole.string();
}

std::string beside(const std::string& target) {
  return takes_whatever_comes(target) ? target : target + ".partial-" + std::to_string(getpid());
}

std::vector<std::string> left_behind(const std::string& target, const std::string& name) {
  return name == target ? std::vector<std::string>() : std::vector<std::string>{name};
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code absent;
  if (fs::equivalent(a, b, absent)) return !takes_whatever_comes(a);
  const fs::path one = fs::weakly_canonical(a, absent), other = fs::weakly_canonical(b, absent);
  return !absent && one == other && !takes_whatever_comes(a);
}

}  // namespace

OutputFile::OutputFile(const std::string& path)
    : path_(path),
      target_(behind_links(path)),
      name_(beside(target_)),
      unfinished_(left_behind(target_, name_)) {
  if (fs::is_directory(target_)) throw Error(path, "it is a folder", "name a file");
}

void OutputFile::publish() {
  if (name_ == target_) return;
  std::error_code error;
  fs::rename(name_, target_, error);
  if (error) throw Error(path_, "the finished file cannot be put in place (" + error.message() + ")");
  unfinished_.keep();
}

void write_picture(const std::string& path, const Image& image) {
  OutputFile file(path);
  try {
    write_png(file.name(), image);
  } catch (const Error& e) {
    throw Error(path, e.problem(), "check the folder, its permissions and the room on the disk");
  }
  file.publish();
}

void refuse_overwriting(const std::string& database, const std::vector<std::string>& outputs) {
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    if (outputs[k].empty()) continue;
    if (same_file(outputs[k], database))
      throw Error(outputs[k], "it is the database itself", "write to another file");
    for (std::size_t j = 0; j < k; ++j)
      if (!outputs[j].empty() && same_file(outputs[k], outputs[j]))
        throw Error(outputs[k], "two outputs have this name", "write to two files");
  }
}

}  // namespace patchwork
