// Numbers as little-endian bytes, whatever the machine.
#pragma once

#include <boost/endian/conversion.hpp>
#include <cstddef>
#include <vector>

namespace patchwork {

/// Puts the sizeof(T) bytes of an integer or an IEEE float behind what is there.
template <class T>
void put_little(std::vector<std::byte>& out, T value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof(T));
  boost::endian::endian_store<T, sizeof(T), boost::endian::order::little>(
      reinterpret_cast<unsigned char*>(out.data() + at), value);
}
/// The number that these sizeof(T) bytes are.
template <class T>
T get_little(const std::byte* from) {
  return boost::endian::endian_load<T, sizeof(T), boost::endian::order::little>(
      reinterpret_cast<const unsigned char*>(from));
}

}  // namespace patchwork
