// The Pico's program in rp2040js, driven like avr_board.c: the same commands on stdin, the same answers on stdout.
// rp2040js (MIT, npm) is looked up from the working directory or NODE_PATH: `npm install rp2040js` in any folder.
// Usage: node pico_board.mjs pico.bin. The boot ROM and the second stage are left out; the program starts at its vectors.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { createInterface } from 'node:readline';

const require = createRequire(process.cwd() + '/');
const { Simulator, LogLevel, ConsoleLogger, USBCDC } = require(process.env.RP2040JS ?? 'rp2040js');

// `driver.inputs` and `board.pins` of the robot file.
const INPUTS = process.env.CHEFBOT_DRIVER_INPUTS ?? 'ina_inb_pwm', GP = JSON.parse(process.env.CHEFBOT_PINS);
const ENABLE_DIAG = process.env.CHEFBOT_ENABLE_DIAG === '1';

const VECTORS = 0x10000100, PWM = 0x40050000, GPIO_OUT = 0xd0000010, GPIO_OE = 0xd0000020;
const IMU = 0x68, WHO_AM_I = 0x75, POWER = 0x6b, SAMPLE = 0x3b;
const PINS = [[GP.left_a, GP.left_b], [GP.right_a, GP.right_b]];
const IN_A = [GP.left_in_a, GP.right_in_a], IN_B = [GP.left_in_b, GP.right_in_b], PWM_PINS = [GP.pwm_left, GP.pwm_right];
const ENABLE = GP.enable, ESTOP = GP.estop, TRIGGER = GP.trigger, ECHO = GP.echo;
const LINES = [0, 2, 3, 1];
const PWM_PERIOD = 2400, NEITHER = 9999;

const simulator = new Simulator();
const { rp2040: mcu, clock } = simulator;
mcu.logger = new ConsoleLogger(LogLevel.Error);

// The computer is at the USB connector, or at the UART.
const AT_USB = process.env.CHEFBOT_LINK === 'usb';
const usb = AT_USB ? new USBCDC(mcu.usbCtrl) : null;
const BYTE_NS = AT_USB ? 1000 : 86806;
let plugged = false;
const atUart = [];

const said = [], queue = [];
let byteDue = 0;
const turns = [0, 0], turnEvery = [0, 0], turnNext = [0, 0], phase = [0, 0];
const imu = new Uint8Array(128);
let imuAnswers = true, imuIndex = 0, imuWritten = 0;
let steps = 0, cycles = 0, longest = 0, began = 0, resets = 0, echoUs = 0, driverFault = false;

function putImu(raw) {
  raw.forEach((value, i) => {
    imu[SAMPLE + 2 * i] = (value >> 8) & 255;
    imu[SAMPLE + 2 * i + 1] = value & 255;
  });
}

function connectImu() {
  const bus = mcu.i2c[0];
  bus.onStart = () => { imuWritten = 0; bus.completeStart(); };
  bus.onConnect = (address) => bus.completeConnect(imuAnswers && address === IMU);
  bus.onWriteByte = (value) => {
    if (imuWritten++ === 0) imuIndex = value & 127;
    else imu[imuIndex++ & 127] = imuIndex - 1 === POWER && value & 0x80 ? 0x40 : value;
    bus.completeWrite(true);
  };
  bus.onReadByte = () => bus.completeRead(imu[imuIndex++ & 127]);
  bus.onStop = () => bus.completeStop();
}

function showLines(wheel) {
  const lines = LINES[phase[wheel] & 3];
  mcu.gpio[PINS[wheel][0]].setInputValue(Boolean(lines & 2));
  mcu.gpio[PINS[wheel][1]].setInputValue(Boolean(lines & 1));
}

function turnDue(wheel) {
  if (!turns[wheel] || clock.nanos < turnNext[wheel]) return;
  const way = Math.sign(turns[wheel]);
  phase[wheel] += way;
  turns[wheel] -= way;
  turnNext[wheel] += turnEvery[wheel];
  showLines(wheel);
}

function pwm(pin) {
  const slice = PWM + 0x14 * ((pin >> 1) & 7);
  return (mcu.readUint32(slice + 0x0c) >>> (16 * (pin & 1))) & 0xffff;
}

// As in avr_board.c.
function dutyOfTwo(ahead, back) {
  if (!drivers()) return ahead || back ? NEITHER : 0;
  if (ahead !== PWM_PERIOD && back !== PWM_PERIOD) return NEITHER;
  return Math.sign(ahead - back) * Math.round((Math.abs(ahead - back) * 1000) / PWM_PERIOD);
}

// As in avr_board.c.
function drivers() {
  const high = (mcu.readUint32(GPIO_OUT) >>> ENABLE) & 1, isOutput = (mcu.readUint32(GPIO_OE) >>> ENABLE) & 1;
  if (!ENABLE_DIAG) return isOutput && high;
  if (isOutput && high) throw new Error('pico_board: EN/DIAG is driven high');
  return Number(!isOutput && !driverFault);
}

function failDriver(fault) {
  driverFault = fault;
  mcu.gpio[ENABLE].setInputValue(!fault);
}

function duty(wheel) {
  if (INPUTS === 'two_pwm') return dutyOfTwo(pwm(IN_A[wheel]), pwm(IN_B[wheel]));
  const level = pwm(PWM_PINS[wheel]), out = mcu.readUint32(GPIO_OUT);
  const a = (out >>> IN_A[wheel]) & 1, b = (out >>> IN_B[wheel]) & 1;
  if (INPUTS === 'dir_pwm') return b ? NEITHER : (a ? 1 : -1) * Math.round((level * 1000) / PWM_PERIOD);
  return a === b ? 0 : (a ? 1 : -1) * Math.round((level * 1000) / PWM_PERIOD);
}

function runFor(nanos) {
  const end = clock.nanos + nanos, core = mcu.core;
  while (clock.nanos < end) {
    const hasRoom = !AT_USB || usb.txFIFO.itemCount < usb.txFIFO.size;  // the computer waits, as its driver does
    if (queue.length && hasRoom && clock.nanos >= byteDue) {
      if (AT_USB) usb.sendSerialByte(queue.shift());
      else mcu.uart[0].feedByte(queue.shift());
      byteDue = Math.max(byteDue, clock.nanos - BYTE_NS) + BYTE_NS;
    }
    turnDue(0);
    turnDue(1);
    const before = core.IPSR;
    const spent = core.executeInstruction();
    cycles += spent;
    if (before !== 15 && core.IPSR === 15 && !began) { ++steps; began = cycles; }
    if (began && core.IPSR === 0) { longest = Math.max(longest, cycles - began); began = 0; }
    clock.tick((spent * 1e9) / mcu.clkSys);
  }
}

function run(us) {
  for (const wheel of [0, 1]) {
    if (!turns[wheel]) continue;
    turnEvery[wheel] = 6e6 / Math.abs(turns[wheel]);
    turnNext[wheel] = clock.nanos + turnEvery[wheel] * (wheel ? 0.75 : 0.25);
  }
  runFor(us * 1000);
  const answer = [duty(0), duty(1), drivers(), steps, longest, resets];
  const hex = Buffer.from(said.splice(0)).toString('hex') || '-';
  return [...answer, hex].join(' ');
}

// The answer to a control request, or "refused".
function usbRequest(packet) {
  const answer = [], { onEndpointWrite } = mcu.usbCtrl;
  let acknowledged = false;
  mcu.usbCtrl.onEndpointWrite = (endpoint, bytes) => {
    if (endpoint !== 0) return onEndpointWrite(endpoint, bytes);
    answer.push(...bytes);
    acknowledged ||= bytes.length === 0;
  };
  mcu.usbCtrl.sendSetupPacket(packet);
  runFor(1e6);
  mcu.usbCtrl.onEndpointWrite = onEndpointWrite;
  if (mcu.usbCtrl.epStallArm) { mcu.usbCtrl.epStallArm = 0; return 'refused'; }
  return Buffer.from(answer).toString('hex') || (acknowledged ? 'ok' : 'silent');
}

function obey(line) {
  const [verb, ...words] = line.trim().split(' ');
  const [a, b] = words.map(Number);
  switch (verb) {
    case 'run': return run(a);
    case 'tx': queue.push(...Buffer.from(words[0], 'hex')); byteDue = Math.max(byteDue, clock.nanos); break;
    case 'turn': turns[a & 1] += b; break;
    case 'imu': putImu(words.map(Number)); break;
    case 'imu_answers': imuAnswers = Boolean(a); break;
    case 'battery': mcu.adc.channelValues[0] = Math.round((a * 1024) / 4703); break;
    case 'echo': echoUs = a; break;
    case 'usb_port': usb.cdcSetControlLineState(a); break;  // 3: a program opens it, 0: it closes it
    case 'usb_request': return usbRequest(Buffer.from(words[0], 'hex'));
    case 'uart_tx': Buffer.from(words[0], 'hex').forEach((value) => mcu.uart[0].feedByte(value)); break;
    case 'uart_sent': return Buffer.from(atUart.splice(0)).toString('hex') || '-';
    case 'driver_fault': failDriver(Boolean(a)); break;
    case 'estop': mcu.gpio[ESTOP].setInputValue(Boolean(a)); break;
    default: throw new Error(`pico_board: unknown command: ${line}`);
  }
  return 'ok';
}

function load(path) {
  mcu.flash.fill(0xff);
  mcu.flash.set(readFileSync(path));
  mcu.core.VTOR = VECTORS;
  mcu.core.SP = mcu.readUint32(VECTORS);
  mcu.core.PC = mcu.readUint32(VECTORS + 4) & ~1;
  mcu.uart[0].onByte = (value) => (AT_USB ? atUart : said).push(value);
  if (AT_USB) {
    usb.onSerialData = (bytes) => said.push(...bytes);
    usb.onDeviceConnected = () => { plugged = true; };
  }
  mcu.peripherals[0x40058].onWatchdogTrigger = () => { throw new Error('pico_board: the hardware watchdog fired'); };
  imu[WHO_AM_I] = IMU;
  putImu([0, 0, 8192, -3920, 0, 0, 0]);
  connectImu();
  mcu.adc.channelValues[0] = Math.round((12000 * 1024) / 4703);
  mcu.gpio[ESTOP].setInputValue(false);
  if (ENABLE_DIAG) failDriver(false);
  mcu.gpio[ECHO].setInputValue(false);
  showLines(0);
  showLines(1);
  mcu.gpio[TRIGGER].addListener((state) => {
    if (state !== 1 || echoUs < 0) return;
    const fall = clock.createAlarm(() => mcu.gpio[ECHO].setInputValue(false));
    const rise = clock.createAlarm(() => {
      mcu.gpio[ECHO].setInputValue(true);
      fall.schedule((echoUs || 38000) * 1000);
    });
    rise.schedule(460000);
  });
  const started = () => steps > 0 && (plugged || !AT_USB);
  while (!started()) runFor(1000);
  const seen = AT_USB ? steps : 0;
  while (steps === seen) runFor(1000);
  runFor(3e6);
}

load(process.argv[2]);
createInterface({ input: process.stdin }).on('line', (line) => console.log(obey(line)));
