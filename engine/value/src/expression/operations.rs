//! The table of all operations on numbers.

/// Calls a macro with the table of all operations, which is the only place that defines them.
///
/// A row has the name of the operation, its kind, its call in the language, its rough cost, where its result is finite,
/// its manual and its formula. Kinds are `operator` (or an internal operation), `logical` (an operator whose result is
/// true or false), `function`, `fold` (a function of any number of values) and `seeded` (a function that needs the seed
/// of random numbers). The cost is in tenths of a nanosecond per pixel. The result is finite `always`, `kept` (if all
/// arguments are) or `free` (not even then). The formula calls small functions, such as `sin`, which each user of the
/// table defines for its own type of numbers. The two names at the top stand in formulas for the seed of a step and for
/// the period of noise.
///
/// So a new function of the language is one line here.
#[macro_export]
macro_rules! operations {
    ($callback:ident) => {
        $callback! {
            (seed, period)
            Negate operator negate(a) 1 kept "The number with the other sign." = -a;
            Not logical not(a) 1 always "1 where the number is 0, else 0." = truth(a == 0.0);
            Add operator add(a, b) 1 free "The sum." = a + b;
            Subtract operator subtract(a, b) 1 free "The difference." = a - b;
            Multiply function multiply(a, b) 1 free "The product, as the blend mode." = a * b;
            Divide operator divide(a, b) 1 free "The quotient." = a / b;
            Modulo operator modulo(a, b) 1 free "a - b·floor(a/b), which has the sign of b." = modulo(a, b);
            Power function pow(x, y) 34 free "`x` to the power of `y`." = power(x, y);
            Less logical less(a, b) 1 always "1 where a < b, else 0." = truth(a < b);
            LessEqual logical less_equal(a, b) 1 always "1 where a ≤ b, else 0." = truth(a <= b);
            Equal logical equal(a, b) 1 always "1 where a = b, else 0." = truth(a == b);
            NotEqual logical not_equal(a, b) 1 always "1 where a ≠ b, else 0." = truth(a != b);
            And logical and(a, b) 1 always "1 where no number is 0, else 0." = truth((a != 0.0) & (b != 0.0));
            Or logical or(a, b) 1 always "0 where both numbers are 0, else 1." = truth((a != 0.0) | (b != 0.0));
            Finite operator finite(a) 1 always "The number; 0 where it is not finite." = finite(a);

            Abs function abs(x) 1 kept "The number without its sign." = abs(x);
            Sign function sign(x) 1 always "-1, 0 or 1." = truth(x > 0.0) - truth(x < 0.0);
            Floor function floor(x) 1 kept "The next whole number below." = floor(x);
            Ceil function ceil(x) 1 kept "The next whole number above." = ceil(x);
            Round function round(x) 1 kept "The nearest whole number; halves go away from 0." = round(x);
            Fract function fract(x) 1 kept "The rest of `x` after `floor(x)` is taken away." = x - floor(x);
            Snap function snap(x, step) 2 free "`x` rounded down to a multiple of `step`; `x` where `step` is 0."
                = if step == 0.0 { x } else { step * floor(x / step) };
            Triangle function triangle(x) 1 kept "0 at whole numbers, 1 halfway between them, and linear between."
                = 1.0 - abs(2.0 * (x - floor(x)) - 1.0);
            Sqrt function sqrt(x) 2 free "The square root." = sqrt(x);
            Cbrt function cbrt(x) 15 kept "The cube root." = cbrt(x);
            Exp function exp(x) 9 free "e to the power of `x`." = exp(x);
            Log function log(x) 9 free "The natural logarithm." = log(x);
            Log2 function log2(x) 7 free "The logarithm to base 2." = log2(x);
            Sin function sin(angle) 14 kept "The sine of an angle in degrees." = sin(angle);
            Cos function cos(angle) 14 kept "The cosine of an angle in degrees." = cos(angle);
            Tan function tan(angle) 18 free "The tangent of an angle in degrees." = sin(angle) / cos(angle);
            Asin function asin(x) 12 free "The angle in degrees whose sine is `x`." = asin(x);
            Acos function acos(x) 13 free "The angle in degrees whose cosine is `x`." = acos(x);
            Atan function atan(x) 10 kept "The angle in degrees whose tangent is `x`." = atan(x);
            Atan2 function atan2(y, x) 10 kept "The angle in degrees of the vector `(x, y)`." = atan2(y, x);
            Srgb function srgb(x) 33 kept "The sRGB encoding of a linear value." = srgb(x);
            FromSrgb function from_srgb(x) 32 free "The linear value of an sRGB encoding." = from_srgb(x);

            Min fold min(a, b) 1 kept "The smallest of its values." = min(a, b);
            Max fold max(a, b) 1 kept "The largest of its values." = max(a, b);
            SmoothMin function smooth_min(a, b, k) 3 free "The smaller of `a` and `b`, rounded over a width `k`."
                = {
                    let width = max(abs(k), 1e-20);
                    let part = max(width - abs(a - b), 0.0) / width;
                    min(a, b) - part * part * width * 0.25
                };
            SmoothMax function smooth_max(a, b, k) 3 free "The larger of `a` and `b`, rounded over a width `k`."
                = {
                    let width = max(abs(k), 1e-20);
                    let part = max(width - abs(a - b), 0.0) / width;
                    max(a, b) + part * part * width * 0.25
                };
            If function if(condition, a, b) 1 kept "`a` where the condition is not 0, else `b`."
                = if condition != 0.0 { a } else { b };
            Clamp function clamp(x, lo, hi) 1 kept "`x`, but not less than `lo` and not more than `hi`."
                = min(max(x, lo), hi);
            Mix function mix(a, b, t) 1 free "`a` where `t` is 0, `b` where it is 1, and between." = a + (b - a) * t;
            Step function step(edge, x) 1 always "0 below the edge, else 1." = truth(x >= edge);
            Smoothstep function smoothstep(e0, e1, x) 3 kept "0 below `e0`, 1 above `e1`, and a smooth step between."
                = {
                    let t = saturate((x - e0) / (e1 - e0));
                    if e0 == e1 { truth(x >= e0) } else { t * t * (3.0 - 2.0 * t) }
                };
            Screen function screen(a, b) 1 free "The blend mode 1 - (1-a)(1-b), which brightens." = a + b - a * b;
            Overlay function overlay(a, b) 2 free "The blend mode: multiply where `a` is dark, screen where it is bright."
                = if a < 0.5 {
                    2.0 * b * a
                } else {
                    let bright = 2.0 * a - 1.0;
                    b + bright - b * bright
                };
            SoftLight function soft_light(a, b) 4 free "The blend mode: like overlay, but gentler, and by `b`."
                = {
                    let low = ((16.0 * a - 12.0) * a + 4.0) * a;
                    let lighter = if a <= 0.25 { low } else { sqrt(a) };
                    if b <= 0.5 { a - (1.0 - 2.0 * b) * a * (1.0 - a) } else { a + (2.0 * b - 1.0) * (lighter - a) }
                };

            Random seeded random(i) 5 always "A random number, 0 ≤ r < 1, that depends on `i` and on the seed."
                = random(seed, i);
            Piece operator random_of_piece(i) 41 always "The random number of a piece, 0 ≤ r < 1." = of_piece(seed, i);
            Hash operator hash(before, x) 5 always "A random number from a previous one and one more number."
                = hash(seed, before, x);
            Noise seeded noise(x, y) 29 kept "Smooth noise from 0 to 1 with cells of size 1." = noise(seed, x, y, period);
            Noise3 seeded noise(x, y, z) 65 kept "The same in space." = noise3(seed, [x, y, z], period);
        }
    };
}
