#version 300 es
precision highp float;
precision highp int;
precision highp usampler2DArray;
precision highp sampler3D;

uniform highp usampler2DArray image;
uniform highp sampler3D table;
uniform highp float u[ARGUMENTS];
uniform highp vec3 place;      // column and row of the image under the first pixel, and pixels a pixel
uniform highp float rows;      // of the canvas
uniform highp float exposure;
uniform highp vec3 surround;
uniform bool soft;             // highlights are compressed below the white instead of cut off
uniform int taps;              // a pixel shows the mean of taps x taps places
uniform bool measuring;        // XYZ of each pixel of the image from the first one on, instead of the picture
out highp vec4 colour;

const float SCALE[CHANNELS] = float[](SCALES);
const int ZERO[CHANNELS] = int[](ZEROS);

float channel(int k, ivec2 at) {
  return float(int(texelFetch(image, ivec3(at, k), 0).r) - ZERO[k]) * SCALE[k];
}

bool isGap(int k, ivec2 at) { return texelFetch(image, ivec3(at, k), 0).r == 65535u; }

FUNCTIONS

vec3 reflected(ivec2 at) {
  vec3 xyz;
BODY
  return xyz;
}

// What is no number counts as 0, what is infinite as very bright.
float shownNumber(float a) {
  uint bits = floatBitsToUint(a) & 0x7fffffffu;
  return bits > 0x7f800000u ? 0.0 : clamp(a, -1e6, 1e6);
}

vec3 numbers(vec3 a) { return vec3(shownNumber(a.x), shownNumber(a.y), shownNumber(a.z)); }

// As "roll-off" of iccbrdf.images.showing.
vec3 rolledOff(vec3 xyz) {
  const vec3 white = vec3(0.9642, 1.0, 0.8249);
  if (xyz.y <= 0.9) return xyz;
  float left = exp((0.9 - xyz.y) * 10.0);
  return (1.0 - 0.1 * left) * (white + left * (xyz / xyz.y - white));
}

DISPLAY

// `reflected` is called at one place, as drivers write it out at each and take long over it.
void main() {
  ivec2 size = textureSize(image, 0).xy;
  vec2 corner = vec2(gl_FragCoord.x - 0.5, rows - gl_FragCoord.y - 0.5);
  vec2 centre = place.xy + (corner + 0.5) * place.z;
  bool beside = any(lessThan(centre, vec2(0.0))) || any(greaterThanEqual(centre, vec2(size)));
  if (beside && !measuring) {
    colour = vec4(surround, 1.0);
    return;
  }
  vec3 sum = vec3(0.0);
  for (int k = 0; k < taps * taps; k++) {
    vec2 part = (vec2(k % taps, k / taps) + 0.5) / float(taps);
    ivec2 at = clamp(ivec2(floor(place.xy + (corner + part) * place.z)), ivec2(0), size - 1);
    if (measuring) at = ivec2(gl_FragCoord.xy) + ivec2(place.xy);
    sum += numbers(reflected(at));
  }
  vec3 mean = sum * (exposure / float(taps * taps));
  colour = vec4(measuring ? sum : shown(soft ? rolledOff(mean) : mean), 1.0);
}
