/* Second stage of the RP2040's start: 256 bytes that the boot ROM copies to RAM and runs if their CRC holds (seal.py writes
   it). Sets the flash interface to the plain read command 03h, which every flash chip knows, and jumps to the vectors
   behind it. RP2040 data sheet, 2.8.1 and 4.10. */
.syntax unified
.cpu cortex-m0plus
.thumb
.section .boot2, "ax"
    ldr r0, =0x18000000         /* SSI */
    movs r1, #0
    str r1, [r0, #0x08]         /* SSIENR: off while it is set up */
    movs r1, #4
    str r1, [r0, #0x14]         /* BAUDR: clk_sys / 4 */
    ldr r1, =0x001F0300         /* CTRLR0: 32 bits a frame, "EEPROM read" */
    str r1, [r0, #0x00]
    movs r1, #0
    str r1, [r0, #0x04]         /* CTRLR1: one frame */
    ldr r1, =0x03000218         /* SPI_CTRLR0: command 03h, 8 bits of it, 24 of address */
    movs r2, #0xF4
    str r1, [r0, r2]
    movs r1, #1
    str r1, [r0, #0x08]
    ldr r0, =0x10000100
    ldr r1, =0xE000ED08         /* VTOR */
    str r0, [r1]
    ldr r1, [r0, #0]
    msr msp, r1
    ldr r1, [r0, #4]
    bx r1
.ltorg
.balign 256, 0
